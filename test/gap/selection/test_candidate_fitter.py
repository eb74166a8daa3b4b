"""Sets of candidates, screened and fitted; truth: the effect that was flown, and fits that give no numbers."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import Candidate, candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.selection.screening import Screened, ScreenedPair
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def late(aircraft) -> tuple[CandidateFitter, FittedSet, dict[str, Candidate]]:
    """A flight with late commands: its fitter, nuisances alone, and three candidates by label."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"command_delay": {"delay": 0.1}}, seed=14))
    nuisances = nuisances_of(aircraft, model)
    fitter = CandidateFitter(nuisances, Checkpoint())
    wanted = ("command_delay", "thrust_scale", "stuck_surface of elevator")
    candidates = {c.label: c for c in candidates_of(model.simulator, [model]) if c.label in wanted}
    return fitter, fitter.fit_set(unfitted([model], nuisances), []), candidates


def silent(share: float, text: str) -> None:
    """No progress shown."""


def test_screening_ranks_the_true_effect_first_and_says_how_far_it_got(late) -> None:
    fitter, base, candidates = late
    shares = []
    screened = CandidateFitter(fitter.nuisances, Checkpoint()).screen(
        base, list(candidates.values()), lambda share, text: shares.append(share)
    )
    assert screened[0][1].label == "command_delay"
    assert [deviance for deviance, _, _ in screened] == sorted(deviance for deviance, _, _ in screened)
    assert shares == sorted(shares) and shares[-1] == pytest.approx(0.5)


def test_a_set_is_fitted_once_and_ranked_by_its_predictions(late) -> None:
    fitter, base, candidates = late
    pairs = fitter.screen_upon([base], [candidates["thrust_scale"], candidates["command_delay"]], silent)
    (_, best), (_, other) = fitter.fit_screened(pairs, silent)
    assert best.added is candidates["command_delay"] and best.evidence.total > other.evidence.total
    assert best.fit.values[0] == pytest.approx(0.1, rel=0.05)
    assert fitter.add_candidate(base, candidates["command_delay"]).fit is best.fit


def test_a_fit_without_numbers_is_no_explanation(late) -> None:
    """Where slopes grow without end a matrix is not positive definite."""

    class Failing(Checkpoint):
        def converged(self, fit):
            raise np.linalg.LinAlgError("not positive definite")

    fitter, base, candidates = late
    failing = CandidateFitter(fitter.nuisances, Failing())
    assert failing.add(base, Screened(0.0, candidates["command_delay"], (0.02,))) is None
    pair = ScreenedPair(base, Screened(0.0, candidates["command_delay"], (0.02,)))
    assert failing.fit_screened([pair], silent) == []


def test_a_start_that_is_not_finite_is_no_explanation(late) -> None:
    """SciPy's own error for it would end the diagnosis."""
    fitter, base, candidates = late
    assert (
        CandidateFitter(fitter.nuisances, Checkpoint()).add(base, Screened(0.0, candidates["command_delay"], (np.nan,)))
        is None
    )


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_screening_leaves_infinitely_much_where_no_numbers_come(late) -> None:
    fitter, base, candidates = late
    endless = replace(candidates["command_delay"], starts=((np.nan,),))
    ((deviance, candidate, _),) = CandidateFitter(fitter.nuisances, Checkpoint()).screen(base, [endless], silent)
    assert deviance == np.inf and candidate is endless
