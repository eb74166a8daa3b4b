"""Deflections from commands: what the aircraft file says of the servos, solved exactly between commands.

A command is held from its message to the next. After ``delay`` it reaches the servo, a lag of first order,

    T dx/dt + x = u,

or of second order, x'' + 2 z w x' + w^2 x = w^2 u with w = 1 / T and the damping z. Then the rate limit follows. The
simulator's stations ``command`` and ``actuator`` have the same elements in the same order. Times are stamps in whole
nanoseconds. A lag is solved in closed form over every interval in which the command is constant (Franklin, Powell &
Workman, "Digital Control of Dynamic Systems", 3rd ed., 1998, sec. 4.3), so that stamps may be irregular.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from sysid_node.aircraft.model import Aircraft

MOST_PENDING = 8192  # commands that wait for their delay to pass: 8 s at 1000 Hz


@dataclass(frozen=True)
class Servo:
    """The servo of one control, or the motor. Zero and infinite values leave the element out."""

    time_constant: float = 0.0  # s
    damping: float = 0.0  # of second order; 0 = first order
    delay: float = 0.0  # s
    rate_limit: float = math.inf  # rad/s


def servos_of(aircraft: Aircraft) -> tuple[Servo, ...]:
    """The motor, then the servo of each control, in the order of ``Actuation``: what the file states, and no more.

    How much later a surface follows is for the estimator to tell, which knows the file's servos from here.
    """
    effects: Mapping[str, Mapping[str, float]] = {
        effect: {name: item.value for name, item in items.items()} for effect, items in aircraft.effects.items()
    }
    lags, limits = effects.get("actuator_lag", {}), effects.get("actuator_rate_limit", {})
    delays = effects.get("command_delay", {})
    motor = Servo(effects.get("motor_lag", {}).get("time_constant", 0.0), delay=delays.get("throttle", 0.0))
    controls = []
    for name in aircraft.controls:
        lag = (lags[name], lags.get("damping", 0.0)) if name in lags else (0.0, 0.0)
        controls.append(Servo(*lag, delays.get(name, 0.0), limits.get(name, math.inf)))
    return (motor, *controls)


@dataclass(slots=True)
class ServoState:
    """A servo's state at ``time``, and the commands that have not reached it yet."""

    servo: Servo
    time: int | None = None  # ns; None = no command has come yet
    command: float = 0.0
    lagged: float = 0.0
    rate: float = 0.0  # of ``lagged``, 1/s
    position: float = 0.0  # after the rate limit
    seen: int | None = None  # ns: when ``move`` was last called
    seen_position: float = 0.0  # then
    area: float = 0.0  # s: integral since then of the position beyond ``seen_position``
    pending: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=MOST_PENDING))  # ns at the servo


def give(state: ServoState, stamp: int, command: float) -> None:
    """Take a command, given at ``stamp`` (ns, increasing). The first one finds the servo at rest there."""
    arrives = stamp + round(state.servo.delay * 1e9)
    if state.time is None:
        state.time = arrives
        state.command = state.lagged = state.position = command
    else:
        state.pending.append((arrives, command))


def move(state: ServoState, stamp: int) -> tuple[float, float]:
    """The deflection at ``stamp`` (ns), which must not be before that of the last call; and an excess.

    Estimators take signals as straight lines between samples. The excess is by how much the mean deflection since the
    last call is above that of such a line: a command that is followed at once, or a servo that begins to move, lies
    between two samples. Zero at the first call.
    """
    pending = state.pending
    while pending and pending[0][0] <= stamp:
        arrives, command = pending.popleft()
        _hold(state, arrives)
        state.command = command
        if state.servo.time_constant == 0.0 and state.servo.rate_limit == math.inf:
            state.lagged = state.position = command
    _hold(state, stamp)
    excess = 0.0
    if state.seen is not None and stamp > state.seen:
        excess = state.area / ((stamp - state.seen) / 1e9) - 0.5 * (state.position - state.seen_position)
    state.seen, state.seen_position, state.area = stamp, state.position, 0.0
    return state.position, excess


def _hold(state: ServoState, stamp: int) -> None:
    """Advance the state to ``stamp`` (ns) at a constant command."""
    if state.time is None or stamp <= state.time:
        return
    servo, step, before = state.servo, (stamp - state.time) / 1e9, state.position
    state.time = stamp
    area = _follow(state, step)
    if servo.rate_limit == math.inf:
        state.position = state.lagged
    else:
        most = servo.rate_limit * step
        state.position += min(max(state.lagged - state.position, -most), most)
        area = 0.5 * (before + state.position) * step
    state.area += area - state.seen_position * step


def _follow(state: ServoState, step: float) -> float:
    """Advance the lag by a ``step`` (s); returns the integral of ``lagged`` over it, from the lag's own equation."""
    T, z = state.servo.time_constant, state.servo.damping
    x, rate = state.lagged, state.rate
    if T == 0.0:
        state.lagged = state.command
        return state.command * step
    if z == 0.0:
        state.lagged = state.command + (x - state.command) * math.exp(-step / T)
        return state.command * step - T * (state.lagged - x)
    error, state.rate = _second_order(state.servo, x - state.command, rate, step)
    state.lagged = error + state.command
    return state.command * step - T * T * (state.rate - rate) - 2.0 * z * T * (state.lagged - x)


def _second_order(servo: Servo, error: float, rate: float, step: float) -> tuple[float, float]:
    """Error from the command and rate after a ``step`` (s): exp(A step) of x'' + 2 z w x' + w^2 x = 0.

    With D = w^2 (z^2 - 1), exp(A h) = exp(-z w h) (cosh(h sqrt D) I + sinh(h sqrt D) / sqrt D (A + z w I)).
    """
    w, z = 1.0 / servo.time_constant, servo.damping
    root = w * math.sqrt(abs(z * z - 1.0))
    fade = math.exp(-z * w * step)
    if root * step < 1e-9:
        c, s = fade, fade * step
    elif z < 1.0:
        c, s = fade * math.cos(root * step), fade * math.sin(root * step) / root
    else:
        up, down = math.exp((root - z * w) * step), math.exp((-root - z * w) * step)
        c, s = 0.5 * (up + down), 0.5 * (up - down) / root
    return c * error + s * (z * w * error + rate), c * rate - s * (w * w * error + z * w * rate)


def in_words(aircraft: Aircraft) -> str:
    """What the aircraft file states of the servos, as the end of a sentence."""
    servos_in_words = [
        f"{name} {', '.join(words)}"
        for name, servo in zip(aircraft.controls, servos_of(aircraft)[1:], strict=True)
        if (words := _words(servo))
    ]
    stated = "; ".join(servos_in_words)
    return f"servos by the aircraft file: {stated}" if stated else "the aircraft file states nothing of the servos"


def _words(servo: Servo) -> list[str]:
    order = f", second order with a damping of {servo.damping:g}" if servo.damping else ""
    words = [f"{1e3 * servo.time_constant:.3g} ms{order}"] if servo.time_constant else []
    words += [f"{1e3 * servo.delay:.3g} ms of delay"] if servo.delay else []
    return words + ([f"{servo.rate_limit:.3g} rad/s at most"] if servo.rate_limit < math.inf else [])
