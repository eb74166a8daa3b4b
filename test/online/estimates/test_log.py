"""Estimates that lie on the disk are those that were added, bit for bit."""

import numpy as np
import pytest

from sysid_node.online.estimates.log import EstimatesLog
from sysid_node.online.estimates.rows import DerivativeRows, FitRows
from sysid_node.online.status import Vocabulary
from sysid_node.online.types import DerivativeEstimate, Estimates

WORDS = Vocabulary(("ok", "converging", "not excited"), 3)


def solved(k: int) -> Estimates:
    rng = np.random.default_rng(k)
    rows = DerivativeRows(("Cm_alpha", "Cm_de"), rng.normal(size=(2, 6)), rng.integers(0, 3, 2).astype(np.uint8), WORDS)
    fits = FitRows(("Cm",), np.array([[0.5, *rng.normal(size=2), 12.0 + k]]))
    late, valid = rng.normal(size=6).tolist(), bool(k % 2)
    value, error, lower, upper, *parts = late
    servo = DerivativeEstimate("elevator", value, error, lower, upper, valid, "ok" if valid else "converging", *parts)
    return Estimates(0.1 * k, rows, fits, {"elevator": servo} if k % 3 else {})


def nothing_known(k: int) -> Estimates:
    unknown = DerivativeEstimate("Cm_de", np.nan, np.inf, -np.inf, np.inf, False, "converging")
    return Estimates(0.1 * k, {"Cm_de": unknown}, {})


def bits(one: Estimates) -> list[str]:
    rows = (*one.derivatives.values(), *one.fits.values(), *one.servos.values())
    return [one.time.hex(), *one.derivatives, *one.fits, *one.servos, *map(repr, rows)]


def test_what_is_read_is_what_was_added() -> None:
    wanted = [nothing_known(0), *(solved(k) for k in range(1, 600)), nothing_known(600)]
    log = EstimatesLog()
    for one in wanted:
        log.append(one)
    assert len(log) == len(wanted)
    assert [bits(one) for one in log] == [bits(one) for one in wanted]
    assert bits(log[-1]) == bits(wanted[-1])
    assert [bits(one) for one in log[9::10]] == [bits(one) for one in wanted[9::10]]
    log.append(solved(601))
    assert bits(log[601]) == bits(solved(601))
    with pytest.raises(IndexError):
        log[602]
