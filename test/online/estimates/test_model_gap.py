"""The live gap: none where the file is what was estimated, and the right derivative where the file is wrong."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.online import estimator
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.estimates.current_solution import current_solution
from sysid_node.online.estimates.model_gap import CoefficientGap, model_gap
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates

# Instruments are made with the file's values; least squares does not depend on them.
SETTINGS = OnlineSettings(method="sls_rft")
BAG = Path(__file__).resolve().parents[3] / "bags" / "cdrw_multistep"


def flown(aircraft: Aircraft) -> tuple[Estimates, dict[str, CoefficientGap]]:
    """Estimates and gap after 25 s of the bundled flight."""
    aligned = align_streams(aircraft, read_streams(BAG), SETTINGS.max_gap)
    state = estimator.init(aircraft, SETTINGS)
    assert not model_gap(state, current_solution(state))
    for time, sample in zip(aligned.time[:5000].tolist(), aligned.samples.tolist(), strict=False):
        estimator.update(state, time, sample)
    return estimate(state), {gap.coefficient: gap for gap in model_gap(state, current_solution(state))}


def with_values(aircraft: Aircraft, values: dict[str, float]) -> Aircraft:
    changed = {n: replace(d, value=values[n]) if n in values else d for n, d in aircraft.derivatives.items()}
    return replace(aircraft, derivatives=changed)


@pytest.fixture(scope="module")
def cdrw() -> Aircraft:
    """Its file as a simulator's, so that only its derivatives may be wrong."""
    exact = dict.fromkeys(("accel", "gyro", "alpha", "beta", "airspeed"), 0.0)
    return replace(load_aircraft("cdrw"), ideal=True, noise_bias=exact)


def test_a_file_that_says_what_was_estimated_leaves_the_noise(cdrw: Aircraft) -> None:
    """Least squares does not depend on the file's values, so its estimates can be put there: what is left is noise."""
    estimates, gaps = flown(cdrw)
    _, closed = flown(with_values(cdrw, {name: d.value for name, d in estimates.derivatives.items()}))
    for coefficient, gap in closed.items():
        assert gap.gap_std == pytest.approx(gap.noise_std, rel=0.2), coefficient
        assert gap.noise_std == pytest.approx(gaps[coefficient].noise_std, rel=1e-9)
        assert gap.deviation < 1e-6


def test_a_wrong_derivative_is_named(cdrw: Aircraft) -> None:
    """Half the elevator's moment in the file: Cm no longer fits, by Cm_de."""
    _, right = flown(cdrw)
    _, wrong = flown(with_values(cdrw, {"Cm_de": 0.5 * cdrw.derivatives["Cm_de"].value}))
    assert wrong["Cm"].derivative == "Cm_de"
    assert wrong["Cm"].deviation > 2.0
    assert wrong["Cm"].gap_std > 2.0 * right["Cm"].gap_std
    for coefficient in ("CL", "CD", "CY", "Cl", "Cn"):
        assert wrong[coefficient] == right[coefficient]


def test_a_file_without_motion_explains_nothing(cdrw: Aircraft) -> None:
    _, gaps = flown(with_values(cdrw, dict.fromkeys(cdrw.derivatives, 0.0)))
    assert all(math.isclose(gap.relative, 1.0, rel_tol=1e-9) for gap in gaps.values())
