"""What is right of a diagnosis, by the label of its case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.withheld.drawing import FOREIGN, INHERENT, LOADED_ASIDE

#: Probability from which an effect counts as blamed.
BLAMED = 0.9

#: Most effects that a set named together may hold.
TOGETHER = 3

#: Verdict of a diagnosis that ended in an error or a refusal: wrong, whatever is there.
FAILED = "failed"
FAILURE = {
    "verdict": FAILED,
    "causes": [],
    "gap": dict.fromkeys(("shrink_percent", "before", "after", "noise_floor"), 0.0),
}

_WITHIN, _ONSET = 0.15, 2.0  # share by which a parameter may be off; seconds of an onset

#: What rounding makes of a percentage: all that could be closed may be 100.00000000000001 % of it.
_ROUNDING = 1e-9

#: Parameters that only shape an effect, or that the drawn value does not determine.
_SHAPES = frozenset({"alpha_star", "frequency", "slope", "onset", "damping"})

_TIMES, _STAMPS = (
    frozenset({"command_delay.delay", "actuator_lag.time_constant"}),
    frozenset({"actuator_stamp_delay.delay"}),
)


@dataclass(frozen=True)
class Judged:
    """One case: its label, what was said, and what of it is right. None: does not apply."""

    label: Mapping[str, Any]
    verdict: str
    named: tuple[tuple[str, ...], ...]  # by cause: the effect, then those it cannot be told from
    stated: tuple[tuple[float, bool], ...]  # probabilities, and whether that effect is there
    right: bool
    every: bool | None  # of two effects: both named
    parameters: tuple[tuple[str, float, float, float], ...]  # name, true, found, standard error
    sized: bool | None  # all of them within 15 % or within the 95 % interval
    onset: float | None  # s off
    gap: Mapping[str, Any]
    flown: Mapping[str, float] | None = None  # errors in the plant: before, after, true_effect
    further: Mapping[str, float] | None = None  # of further flights: before, after, noise_floor, shrink_percent

    @property
    def kind(self) -> str:
        """none, one, two or unlisted."""
        return str(self.label["kind"])

    @property
    def first(self) -> str:
        """What the diagnosis blames first, or its verdict."""
        return self.named[0][0] if self.named else self.verdict

    @property
    def closed(self) -> float:
        """Share of what could be closed on the held-out flight that was, as stated."""
        return float(self.gap["shrink_percent"]) / 100.0

    @property
    def closed_of_true(self) -> float | None:
        """Share of what the true effect closes (``closing``) that was; None where that is next to nothing."""
        if self.flown is None:
            return None
        before, after, best = (self.flown[name] for name in ("before", "after", "true_effect"))
        return (before - after) / (before - best) if best < 0.95 * before else None

    @property
    def covers(self) -> bool | None:
        """Whether the stated interval holds the shrinkage on further flights; None where there is next to no gap."""
        if not self.further or self.further["noise_floor"] > 0.95 * self.further["before"]:
            return None
        low, high = self.gap["ci95"]
        return bool(low - _ROUNDING <= self.further["shrink_percent"] <= high + _ROUNDING)


def judge(label: Mapping[str, Any], said: Mapping[str, Any]) -> Judged:
    """A case by its label and its gap.json."""
    truth = set(label["effects"])
    named = tuple((c["effect"], *c["indistinguishable_from"][: TOGETHER - 1]) for c in said["causes"])
    own = [_has(label, c) or _one_of_its(label, c) for c in said["causes"]]
    stated = tuple(
        (float(c["probability"]), c["effect"] in truth or i) for c, i in zip(said["causes"], own, strict=True)
    )
    parameters = tuple(_parameters(label, said))
    right, every = _right(label, said["verdict"], named, own)
    return Judged(
        label=label,
        verdict=said["verdict"],
        named=named,
        stated=stated,
        right=right,
        every=every,
        parameters=parameters,
        sized=all(_close(*p) for p in parameters) if parameters else None,
        onset=_onset(label, said),
        gap=said["gap"],
    )


def there(label: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether a cause, or one of those named with it, is there."""
    return _named(label, cause) or _has(label, cause) or _one_of_its(label, cause)


def always_there(label: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether it is the plant that has such a cause, and not the case."""
    return there(label, cause) and not _named(label, cause)


def _named(label: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether an effect of the case is a cause or one of those named with it."""
    return not {cause["effect"], *cause["indistinguishable_from"][: TOGETHER - 1]}.isdisjoint(label["effects"])


def _has(label: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether a cause is one that the foreign plant always has, nothing added."""
    if label["plant"] != FOREIGN:
        return False
    if cause["effect"] == "cg_shift" and "y" in cause.get("parameters", {}):
        return _close("y", LOADED_ASIDE, *cause["parameters"]["y"])
    return cause["effect"] in INHERENT


def _one_of_its(label: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether one of the foreign plant's own is named beside a cause as one that it cannot be told from."""
    return label["plant"] == FOREIGN and not set(INHERENT).isdisjoint(cause["indistinguishable_from"][: TOGETHER - 1])


def _right(
    label: Mapping[str, Any], verdict: str, named: tuple[tuple[str, ...], ...], inherent: Sequence[bool]
) -> tuple[bool, bool | None]:
    """Whether the verdict (none, unlisted) or the first name is right; of two effects, whether both are named.

    Of the foreign plant with nothing added: whether nothing is blamed but what it has.
    """
    truth = set(label["effects"])
    if verdict == FAILED:
        return False, False if len(truth) > 1 else None
    if label["kind"] == "none":
        return (verdict != "unsupported" and all(inherent) if label["plant"] == FOREIGN else verdict == "no_gap"), None
    if label["kind"] == "unlisted":
        return verdict == "unknown_effect", None
    first = [n for n, own in zip(named, inherent, strict=True) if truth & set(n) or not own][:1]
    found = {effect for n in named for effect in n}
    return bool(first and set(first[0]) & truth), truth <= found if len(truth) > 1 else None


def _parameters(label: Mapping[str, Any], said: Mapping[str, Any]) -> list[tuple[str, float, float, float]]:
    """Those of the true effects that are blamed by their own name."""
    rows = []
    for cause in said["causes"]:
        for key, true in label["effects"].get(cause["effect"], {}).items():
            full = f"{cause['effect']}.{key}"
            found = _with_all_controls(cause["parameters"], key)
            if key == "rate" and key in found:
                value, error = found[key]
                rows.append((full, 1.0 / true, 1.0 / value, error / value**2))
            elif key in found and key not in _SHAPES and not (cause["effect"] == "stuck_surface" and key == "rudder"):
                value, error = found[key]
                rows.append((full, _shown(full, true, value, label["servo_lag"]), value, error))
    return rows


#: Keys that mean all controls; what is found has a parameter for each control instead.
_OF_ALL = frozenset({"time_constant", "delay", "rate"})


def _with_all_controls(found: Mapping[str, list[float]], key: str) -> Mapping[str, list[float]]:
    """What was found, and under a key that means all controls the median of theirs by value."""
    surfaces = [found[name] for name in ("elevator", "aileron", "rudder") if name in found]
    if key in found or key not in _OF_ALL or not surfaces:
        return found
    return {**found, key: sorted(surfaces)[len(surfaces) // 2]}


def _shown(name: str, true: float, found: float, servo_lag: float) -> float:
    """A time as a flight shows it: later by as much of the servo's own lag as is found, or stamps less late by it.

    What stamps are late by makes a response seem early, and the servo makes it late.
    """
    if name in _TIMES:
        return min(max(found, true), true + servo_lag)
    return max(min(found, true), true - servo_lag) if name in _STAMPS else true


def _close(name: str, true: float, found: float, error: float) -> bool:
    return abs(found - true) <= max(_WITHIN * abs(true), 1.96 * error)


def _onset(label: Mapping[str, Any], said: Mapping[str, Any]) -> float | None:
    """Seconds by which the onset of a true effect is off, where it has one within the flight and was blamed."""
    for cause in said["causes"]:
        true = label["effects"].get(cause["effect"], {}).get("onset", -1.0)
        if true > 0.0 and "onset" in cause["parameters"]:
            return abs(float(cause["parameters"]["onset"][0]) - float(true))
    return None


def line(judged: Judged) -> str:
    """A case in one line."""
    label, gap = judged.label, judged.gap
    truth = " + ".join(f"{n} {_short(v)}" for n, v in label["effects"].items()) or "none"
    said = "; ".join("/".join(names) + f" {p:.2f}" for names, (p, _) in zip(judged.named, judged.stated, strict=True))
    sizes = ", ".join(f"{n} {t:.3g}: {f:.3g}+-{e:.2g}" for n, t, f, e in judged.parameters)
    gaps = " ".join(f"{gap[k]:.3f}" for k in ("before", "after", "noise_floor"))
    mark = "right" if judged.right else "WRONG"
    where = f"{label['plant']} {label['turbulence']} {label['programme']}"
    return f"{mark} [{where}] {truth} -> {judged.verdict}: {said or '-'} | {sizes} | gap {gaps}"


def _short(values: Mapping[str, float]) -> str:
    return ",".join(f"{k}={v:.3g}" for k, v in values.items() if math.isfinite(v))
