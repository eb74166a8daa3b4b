"""One identification, from messages to the estimates to publish: what the node does, without ROS."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from operator import itemgetter
from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.opposite_estimates import opposite_estimates
from sysid_node.flight.align import counts_by_reason
from sysid_node.flight.commanded import carried_in_words
from sysid_node.flight.live.deflections import DeflectionLimits
from sysid_node.flight.live.mean_lift import RecentMeanLift
from sysid_node.flight.live.monitor import Durations
from sysid_node.flight.live.reading_signs import ReadingSignsInFlight
from sysid_node.online import estimator
from sysid_node.online.alignment import schedule, streaming
from sysid_node.online.estimates.covariance import EstimateCovariance, estimate_covariance
from sysid_node.online.estimates.current_solution import CurrentSolution, current_solution
from sysid_node.online.estimates.model_gap import CoefficientGap, model_gap
from sysid_node.online.estimates.published import estimate_of
from sysid_node.online.estimates.servo_gap import ServoGap, servo_gaps, servo_times_in_file, surely_late
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import LIFT, Estimates, controls_in

_of_lift = itemgetter(*LIFT)
UNTOLD = (math.nan, math.nan)  # roll and pitch that nothing measured
BUSY = 0.4  # share of the time between estimates in which nothing long is begun before the next


class Due(NamedTuple):
    """Estimates to publish, what they were made of, and the header stamp of the last sample in them."""

    stamp_ns: int
    estimates: Estimates
    current: CurrentSolution | None


class Session:
    """Aligns messages, updates the estimator with every sample, and estimates when the schedule says so."""

    def __init__(self, aircraft: Aircraft, settings: OnlineSettings, publish_rate: float) -> None:
        self.aircraft = aircraft
        self.settings = settings
        self.publish_rate = publish_rate  # Hz
        self.update_times = Durations()
        self._controls = controls_in(aircraft)
        self._servo_times = servo_times_in_file(aircraft)
        self.reset()

    def reset(self) -> None:
        """Forget all messages and estimates."""
        self.state = estimator.init(self.aircraft, self.settings)
        self.alignment = streaming.init(self.aircraft, self.settings.max_gap, self.settings.actuators)
        self.schedule = schedule.Schedule(self.publish_rate)
        self.lift = RecentMeanLift(self.aircraft)
        self.deflections = DeflectionLimits(self.aircraft)
        self.signs = ReadingSignsInFlight()
        self.samples = 0
        self._correlated: object = None  # the slowly changing quantities whose covariance was asked for last
        self._heard = time.monotonic()
        self._published = -math.inf  # s, time.perf_counter when estimates last fell due
        self._free = (1.0 - BUSY) / self.publish_rate  # s after that in which there is time

    @property
    def commanded(self) -> bool:
        """Whether the estimates take the deflections from commands, and not from measured positions."""
        return self.state.model.sample.commanded

    def carried(self, estimates: Estimates | None = None) -> str:
        """What the actuators' messages are taken for, in words; empty where the user said that they are positions.

        ``estimates`` may tell that these act later than they are recorded.
        """
        late = surely_late(estimates.servos) if estimates else ()
        return carried_in_words(self.aircraft, self.settings.actuators, self.commanded, late)

    @property
    def rejected(self) -> dict[str, int]:
        """Messages left out: ``"<topic>: <reason>"`` -> count."""
        return counts_by_reason(self.alignment.rejected)

    @property
    def force_fault(self) -> str:
        """What is wrong with the mean specific force of the last seconds, in words; empty where nothing is."""
        return self.state.inputs.force.fault

    @property
    def sign_fault(self) -> str:
        """Which readings have the wrong sign or unit by the others, in words; empty where none has."""
        return "" if self.force_fault else self.signs.found.fault

    @property
    def attitude_fault(self) -> str:
        """Which angles of the attitude have the wrong sign, in words. The estimates do not depend on them."""
        return self.signs.found.doubt

    @property
    def unchanging(self) -> str:
        """Which readings stand still, in words; empty where none does."""
        return self.state.inputs.unchanging.fault

    @property
    def interruptions(self) -> str:
        """That the samples come in parts too short to estimate from, in words; empty where they do not."""
        inputs = self.state.inputs
        if inputs.previous is None:
            return ""
        return inputs.interruptions.recent_fault(inputs.previous[0], self.settings.max_gap)

    @property
    def lift_fault(self) -> str:
        """What does not go together of weight, airspeed and angle of attack, in words; empty where nothing is wrong."""
        return "" if self.force_fault else self.lift.fault

    @property
    def faults(self) -> dict[str, str]:
        """What withholds estimates, in words, by its subject."""
        found = {"accelerometer": self.force_fault, "signs": self.sign_fault, "readings": self.unchanging}
        return {subject: text for subject, text in found.items() if text}

    def doubts(self, due: Due | None) -> dict[str, str]:
        """What looks wrong and withholds nothing, in words, by its subject. ``due``: the last estimates, if any."""
        found = {
            "lift": self.lift_fault,
            "deflections": self.deflections.fault,
            "attitude": self.attitude_fault,
            "samples": self.interruptions,
            "derivatives": "; ".join(opposite_estimates(self.aircraft, due.estimates.derivatives)) if due else "",
        }
        return {subject: text for subject, text in found.items() if text}

    @property
    def silence(self) -> float:
        """Seconds since the last sample, on a clock that never jumps."""
        return time.monotonic() - self._heard

    def now(self, silence: float = 0.0) -> Due:
        """What is known ``silence`` s after the last sample. There must be one."""
        last = self.schedule.previous
        assert last is not None
        current = current_solution(self.state)
        estimates = estimate_of(self.state, current, last + silence)
        return Due(streaming.stamp_of(self.alignment, last), estimates, current)

    def renewed_covariance(self) -> EstimateCovariance | None:
        """The covariance of the estimates; None where no renewal has changed its correlations since it was asked for.

        Between renewals variances shrink together, so that correlations stay.
        """
        if self.state.latest is self._correlated:
            return None
        self._correlated = self.state.latest
        return estimate_covariance(self.state)

    def gap(self, due: Due) -> Sequence[CoefficientGap]:
        """How far the flight is from the aircraft file where estimates fell due, before anything else comes."""
        return model_gap(self.state, due.current)

    def servo_gaps(self, due: Due) -> Sequence[ServoGap]:
        """How far the servos are from the aircraft file where estimates fell due."""
        return servo_gaps(self._servo_times, due.estimates.servos)

    def use_pause(self) -> None:
        """Do what would else be done when later samples come; called when all that fell due is published.

        Nothing long is begun where the next estimates may soon fall due.
        """
        estimator.renew_early(self.state)
        if time.perf_counter() - self._published < self._free:
            estimator.use_pause(self.state)

    def refuse(self, topic: str, reason: str) -> None:
        """Count a message that cannot be read."""
        streaming.refuse(self.alignment, topic, reason)

    def imu(self, stamp_ns: int, values: tuple[float, ...], tilt: tuple[float, float] = UNTOLD) -> list[Due]:
        """Take an IMU message: specific force (m/s^2) and rates (rad/s), FRD. Returns what falls due.

        ``tilt``: roll and pitch (rad), NaN where it has no orientation; only the signs are compared with it.
        """
        self.signs.hear(stamp_ns, tilt)
        return self._take(streaming.on_imu(self.alignment, stamp_ns, values))

    def air_data(self, stamp_ns: int, values: tuple[float, ...]) -> list[Due]:
        """Take an air data message: true airspeed (m/s), flow angles (rad), air density (kg/m^3)."""
        return self._take(streaming.on_air_data(self.alignment, stamp_ns, values))

    def actuators(self, stamp_ns: int, names: Sequence[str], positions: Sequence[float]) -> list[Due]:
        """Take joint positions: rad, throttle 0..1 or N."""
        return self._take(streaming.on_actuators(self.alignment, stamp_ns, names, positions))

    def _take(self, samples: Iterable[streaming.AlignedSample]) -> list[Due]:
        results = []
        for moment, sample, wait in samples:
            start = time.perf_counter()
            if moment >= self.alignment.commands_from and not self.state.model.sample.commanded:
                self.state = estimator.begin_with_commands(self.state, moment)
            estimator.update(self.state, moment, sample)
            self.update_times.add(time.perf_counter() - start)
            self.samples += 1
            self.lift.add(moment, *_of_lift(sample))
            self.deflections.add_sample(moment, sample[self._controls])
            if self.signs.wants(moment):
                stamp = streaming.stamp_of(self.alignment, moment)
                if self.signs.add(moment, stamp, sample, opposite_alpha=self.lift.opposite_alpha):
                    self.state.inputs.contradiction = self.signs.found.fault
            self._heard = time.monotonic()
            if schedule.due(self.schedule, moment, wait):
                results.append(self.now())
        if results:
            self._published = time.perf_counter()
        return results
