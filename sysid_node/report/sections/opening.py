"""The opening of a run's report: the results in one paragraph for a pilot."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from markupsafe import Markup

from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.results.comparison import agrees, covers, half_width
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import METHOD_WORDS, short_meaning, status_words, symbol, words_of
from sysid_node.report.wording.numbers import listing, number, plural, seconds

#: What the sign of a derivative means in the air: (derivative, if negative, if positive).
HANDLING = (
    (
        "Cm_alpha",
        "after a disturbance in pitch the aircraft tends back to trim",
        "after a disturbance in pitch the aircraft tends further away from trim",
    ),
    ("Cn_beta", "in a sideslip the nose turns away from the wind", "in a sideslip the nose turns into the wind"),
    ("Cl_p", "a roll decays once the ailerons are centred", "a roll speeds up even with the ailerons centred"),
)


def context(run: RunResult) -> Mapping[str, Any]:
    """The sentences, the remarks, and the facts in one line."""
    final = run.final
    derivatives = list(final.derivatives.values()) if final else []
    sentences: list[Callable[[RunResult, list[DerivativeEstimate]], Markup | None]] = [
        _known,
        _handling,
        _best,
        _unknown,
        _against_truth,
        _against_prior,
    ]
    paragraph = [sentence for make in sentences if (sentence := make(run, derivatives))]
    return {"paragraph": Markup(" ").join(paragraph), "remarks": run.remarks, "facts": _facts(run)}


def _known(run: RunResult, derivatives: list[DerivativeEstimate]) -> Markup:
    length = f"{seconds(run.data.seconds)} of flight" if math.isfinite(run.data.seconds) else "this flight"
    if not derivatives:
        return Markup(
            "<strong>No derivative was estimated</strong> from {} of {}. The tables below list what was "
            "received and what was rejected."
        ).format(length, run.aircraft)
    valid = sum(d.valid for d in derivatives)
    if not valid:
        return Markup("From {} of {}, <strong>none of the {} is known well enough to use</strong>.").format(
            length, run.aircraft, plural(len(derivatives), "derivative")
        )
    share = f"all {len(derivatives)}" if valid == len(derivatives) else f"{valid} of {len(derivatives)}"
    return Markup(
        "From {} of {}, <strong>{} derivatives are known well enough to use</strong>. Each has "
        "an interval that contains its true value with 95 % confidence."
    ).format(length, run.aircraft, share)


def _handling(_: RunResult, derivatives: list[DerivativeEstimate]) -> Markup | None:
    """What the signs of derivatives mean in flight, of those whose whole interval has one sign."""
    known = {d.name: d for d in derivatives if d.valid}
    clauses = []
    for name, negative, positive in HANDLING:
        d = known.get(name)
        if d is not None and d.lower * d.upper > 0:
            clauses.append(Markup("{} ({})").format(negative if d.upper < 0 else positive, symbol(name)))
    if not clauses:
        return None
    text = Markup("; ").join(clauses)
    return Markup("Their signs say how it flies: {}.").format(text)


def _best(_: RunResult, derivatives: list[DerivativeEstimate]) -> Markup | None:
    ranked = sorted((half_width(d) / abs(d.value), d) for d in derivatives if d.valid and d.value and _named(d))
    if not ranked:
        return None
    relative, best = ranked[0]
    return Markup("The most accurate is {} ({}), within ±{}\u202f%.").format(
        symbol(best.name), short_meaning(best.name), number(100 * relative, 2)
    )


def _unknown(_: RunResult, derivatives: list[DerivativeEstimate]) -> Markup | None:
    by_status: dict[str, list[Markup]] = {}
    for d in derivatives:
        if not d.valid:
            by_status.setdefault(status_words(d.status), []).append(symbol(d.name))
    if not by_status:
        return None
    reasons = [Markup("{} ({})").format(listing(names), words) for words, names in by_status.items()]
    return Markup("<strong>Do not use</strong> {}.").format(Markup("; ").join(reasons))


def _against_truth(run: RunResult, derivatives: list[DerivativeEstimate]) -> Markup | None:
    checked = [d for d in derivatives if d.valid and d.name in run.references.truth]
    if not checked:
        return None
    covered = sum(covers(d, run.references.truth[d.name]) for d in checked)
    return Markup("The true values are known for this flight: {} of {} valid intervals contain theirs.").format(
        covered, len(checked)
    )


def _against_prior(run: RunResult, derivatives: list[DerivativeEstimate]) -> Markup | None:
    prior = run.references.prior
    checked = [d for d in derivatives if d.valid and d.name in prior]
    if not checked:
        return None
    differing = [d for d in checked if not agrees(d, prior[d.name])]
    if not differing:
        return Markup("No estimate differs from the aircraft file by more than the two uncertainties explain.")
    clauses = [Markup("{} is {}").format(symbol(d.name), _difference(d.value, prior[d.name].value)) for d in differing]
    return Markup("These differ from the aircraft file by more than the two uncertainties explain: {}.").format(
        listing(clauses)
    )


def _difference(value: float, prior: float) -> str:
    """``"46 % weaker"``."""
    if value * prior <= 0:
        return "of the opposite sign" if value * prior < 0 else "not zero"
    percent = number(100 * abs(value / prior - 1), 2)
    return f"{percent}\u202f% {'weaker' if abs(value) < abs(prior) else 'stronger'}"


def _named(d: DerivativeEstimate) -> bool:
    """Whether a derivative can be named as the most accurate: offsets are left out."""
    return not d.name.endswith("_0") and math.isfinite(half_width(d))


def _facts(run: RunResult) -> list[tuple[str, str]]:
    lost = sum(run.data.rejected.values())
    return [
        ("Aircraft", run.aircraft),
        ("Method", METHOD_WORDS.get(run.method, words_of(run.method))),
        ("Data", f"{seconds(run.data.seconds)}, {plural(run.data.samples, 'sample')}"),
        ("Rejected", plural(lost, "message") if lost else "nothing"),
    ]


SECTION: Section[RunResult] = Section("opening", "", "opening.html.j2", context)
