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
from sysid_node.gap.selection.candidate_fitter import CandidateFitter, FittedSet, best_screened, with_found_onsets
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
    assert failing.add(base, (0.0, candidates["command_delay"], (0.02,))) is None
    assert failing.fit_screened([(base, (0.0, candidates["command_delay"], (0.02,)))], silent) == []


def test_a_start_that_is_not_finite_is_no_explanation(late) -> None:
    """SciPy's own error for it would end the diagnosis."""
    fitter, base, candidates = late
    assert (
        CandidateFitter(fitter.nuisances, Checkpoint()).add(base, (0.0, candidates["command_delay"], (np.nan,))) is None
    )


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_screening_leaves_infinitely_much_where_no_numbers_come(late) -> None:
    fitter, base, candidates = late
    endless = replace(candidates["command_delay"], starts=((np.nan,),))
    ((deviance, candidate, _),) = CandidateFitter(fitter.nuisances, Checkpoint()).screen(base, [endless], silent)
    assert deviance == np.inf and candidate is endless


def labelled(effect: str, control: str = "") -> Candidate:
    return Candidate(effect, f"{effect} of {control}" if control else effect, (0,), ((0.1,), (0.2,)))


def test_the_best_of_each_explanation_are_kept_at_most_two_of_one_effect(late) -> None:
    _, base, _ = late
    other = replace(base)
    surfaces = [labelled("stuck_surface", control) for control in ("elevator", "aileron", "rudder")]
    screened = [(base, (float(k), candidate, (0.1,))) for k, candidate in enumerate([*surfaces, labelled("cg_shift")])]
    screened.append((other, (9.0, labelled("mass_error"), (0.1,))))
    kept = best_screened(screened, 3)
    assert [pair[1][1].label for pair in kept] == [
        "stuck_surface of elevator",
        "stuck_surface of aileron",
        "cg_shift",
        "mass_error",
    ]
    assert best_screened(screened, 1) == [screened[0], screened[-1]]


def test_onsets_that_were_found_are_the_only_starts_of_the_next_stage() -> None:
    stuck, shift = labelled("stuck_surface", "elevator"), labelled("cg_shift")
    screened = [(1.0, stuck, (0.3,)), (2.0, shift, (0.4,)), (3.0, stuck, (0.9,))]  # the best first
    assert [c.starts for c in with_found_onsets([stuck, shift], screened)] == [((0.3,),), shift.starts]
