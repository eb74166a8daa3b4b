"""The attitude loops of PX4 and ArduPilot, with their default gains, in place of those of the simulator's autopilot.

Both demand a rate that takes away the error of the attitude within a time constant T, and deflect a surface by

    F demanded rate + P (demanded rate - rate) + I integral of (demanded rate - rate) dt .

Tuning guides of both set the feedforward F so that the aircraft turns as fast as is demanded: it is the reciprocal of
the aircraft's steady response. The other gains are taken as shares of F, as their default values are. Rudder and
thrust are commanded as by the simulator's own autopilot. Other releases of both have other gains.
"""

from __future__ import annotations

from dataclasses import dataclass

from sysid_node.sim.flying.autopilot import BANDWIDTH, SEEN, Autopilot, autopilot_for
from sysid_node.sim.flying.trim import Trim
from sysid_node.sim.simulator import Simulator


@dataclass(frozen=True)
class RateLoop:
    """Gains of one axis."""

    proportional: float  # share of the feedforward
    integral: float  # the same, 1/s


@dataclass(frozen=True)
class AttitudeLoops:
    """An autopilot's loops in roll and pitch."""

    name: str
    time_constant: float  # s
    roll: RateLoop
    pitch: RateLoop

    def flown_by(self, pilot: Autopilot, commands: tuple[str, ...]) -> Autopilot:
        """The simulator's own ``pilot`` with these loops in roll and pitch; ``commands``: of which its gains are.

        A loop whose surface the aircraft lacks stays open.
        """
        gains, integral = pilot.gains, pilot.integral
        for control, rate, angle, loop in (("aileron", "p", "phi", self.roll), ("elevator", "q", "theta", self.pitch)):
            if control not in commands:
                continue
            row, turned, held = commands.index(control), SEEN.index(rate), SEEN.index(angle)
            feedforward = pilot.gains[row, held] / BANDWIDTH
            # the integral of a rate is the angle
            on_angle = (1.0 + loop.proportional) / self.time_constant + loop.integral
            gains = gains.at[row, held].set(feedforward * on_angle)
            gains = gains.at[row, turned].set(feedforward * loop.proportional)
            integral = integral.at[row, held].set(feedforward * loop.integral / self.time_constant)
        return pilot._replace(gains=gains, integral=integral)


def autopilot_with(loops: AttitudeLoops | None, simulator: Simulator, trim: Trim) -> Autopilot:
    """The autopilot that holds this trim, with these ``loops``; none: with the simulator's own."""
    own = autopilot_for(simulator, trim)
    return own if loops is None else loops.flown_by(own, simulator.commands)


#: ``fw_att_control_params.c``: FW_R_TC and FW_P_TC 0.4 s; FW_RR_FF 0.5, FW_RR_P 0.05, FW_RR_I 0.01; FW_PR_FF 0.5,
#: FW_PR_P 0.08, FW_PR_I 0.02.
PX4 = AttitudeLoops("PX4", 0.4, RateLoop(0.1, 0.02), RateLoop(0.16, 0.04))
#: ``AP_RollController.cpp`` and ``AP_PitchController.cpp``, written as gains of rates: TCONST 0.5 s; feedforward 0.345,
#: P 0.08, I 0.15 in roll; 0.385, 0.04, 0.15 in pitch.
ARDUPILOT = AttitudeLoops("ArduPilot", 0.5, RateLoop(0.23, 0.43), RateLoop(0.1, 0.39))
#: By the name of an autopilot.
LOOPS = {"px4": PX4, "ardupilot": ARDUPILOT}
