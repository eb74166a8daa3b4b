"""From commands to deflections: delay, a servo of second order, and the effects of the actuators' station."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from bench.withheld.plants.motion import Effects


class Actuators:
    """All surfaces and the motor. ``servo`` Hz is the natural frequency of every surface's servo, damping 0.7."""

    def __init__(
        self, trim: Mapping[str, float], limits: Mapping[str, float], effects: Effects, step: float, servo: float
    ) -> None:
        self._effects, self._limits, self._step = effects, limits, step
        self._omega = 2.0 * math.pi * servo
        self._late = {n: _of(effects, "command_delay", "delay", _CALLED.get(n, n), 0.0) / step for n in trim}
        length = int(max(self._late.values())) + 2
        self._history = deque([dict(trim)] * length, maxlen=length)
        clipped = {n: max(-limits[n], min(limits[n], trim[n])) for n in limits}
        self._servo = {n: (x, 0.0) for n, x in clipped.items()}
        self._lagged, self._linked, self._position = dict(clipped), dict(clipped), dict(clipped)
        self._motor = trim["thrust"]

    def move(self, command: Mapping[str, float], time: float) -> tuple[dict[str, float], float]:
        """One step on: the deflections (rad) that count, and the thrust (N)."""
        self._history.append(dict(command))
        arriving = {}
        for name, late in self._late.items():
            newer, older = self._history[-1 - int(late)][name], self._history[-2 - int(late)][name]
            arriving[name] = newer + (late - int(late)) * (older - newer)
        return {n: self._surface(n, arriving[n], time) for n in self._limits}, self._thrust(arriving["thrust"])

    def _surface(self, name: str, command: float, time: float) -> float:
        limit, effects = self._limits[name], self._effects
        wanted = self._servo_step(name, max(-limit, min(limit, command)))
        tau = _of(effects, "actuator_lag", "time_constant", name, 0.0)
        slows = effects.get("servo_slows", {})  # on no list: another lag of a control from ``onset`` (s) on
        tau += slows.get(name, 0.0) if time >= slows.get("onset", math.inf) else 0.0
        share = 1.0 - math.exp(-self._step / tau) if tau else 1.0
        self._lagged[name] += share * (wanted - self._lagged[name])
        play = 0.5 * effects.get("actuator_backlash", {}).get(name, 0.0)
        off = self._lagged[name] - self._linked[name]
        self._linked[name] += math.copysign(max(abs(off) - play, 0.0), off)
        rate = _of(effects, "actuator_rate_limit", "rate", name, math.inf)
        reach = self._linked[name] - self._position[name]
        self._position[name] += math.copysign(min(abs(reach), rate * self._step), reach)
        x = self._position[name] + effects.get("actuator_bias", {}).get(name, 0.0)
        jam, loss = effects.get("stuck_surface", {}), effects.get("control_effectiveness_loss", {})
        if name in jam and time >= jam["onset"]:
            x = jam[f"{name}_position"]
        if name in loss and time >= loss["onset"]:
            x *= 1.0 - loss[name]
        return x * (1.0 - effects.get("control_nonlinearity", {}).get(name, 0.0) * x * x)

    def _servo_step(self, name: str, wanted: float) -> float:
        """Second order, semi-implicit Euler."""
        x, v = self._servo[name]
        v += self._step * (self._omega**2 * (wanted - x) - 1.4 * self._omega * v)
        x += self._step * v
        self._servo[name] = x, v
        return x

    def _thrust(self, command: float) -> float:
        tau = self._effects.get("motor_lag", {}).get("time_constant", 0.0)
        share = 1.0 - math.exp(-self._step / tau) if tau else 1.0
        self._motor += share * (max(command, 0.0) - self._motor)
        return self._motor * (1.0 + self._effects.get("thrust_scale", {}).get("error", 0.0))


#: The word for a command's name among the parameters of effects.
_CALLED = {"thrust": "throttle"}


def _of(effects: Effects, effect: str, key: str, control: str, absent: float) -> float:
    """A control's own value of an effect, or that of ``key``, which is meant for all controls."""
    values = effects.get(effect, {})
    return values.get(control, values.get(key, absent))


def servo_lag(servo: float) -> float:
    """The first-order lag (s) that a servo of this frequency looks like: 2 * 0.7 / omega."""
    return 1.4 / (2.0 * math.pi * servo)
