"""Sets of candidates, screened and fitted; truth: the effect that was flown, and fits that give no numbers."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.screening import Screened, ScreenedPair


def silent(share: float, text: str) -> None:
    """No progress shown."""


def test_screening_ranks_the_true_effect_first_and_says_how_far_it_got(late) -> None:
    fitter, base, candidates = late
    shares = []
    screened = CandidateFitter(fitter.nuisances, Checkpoint()).screen(
        base, list(candidates.values()), lambda share, text: shares.append(share)
    )
    assert screened[0][1].label == "command_delay"
    assert [each.deviance for each in screened] == sorted(each.deviance for each in screened)
    assert shares == sorted(shares) and shares[-1] == pytest.approx(0.5)


def test_a_set_is_fitted_once_and_ranked_by_its_predictions(late) -> None:
    fitter, base, candidates = late
    pairs = fitter.screen_upon([base], [candidates["thrust_scale"], candidates["command_delay"]], silent)
    (_, best), (_, other) = fitter.fit_screened(pairs, silent)
    assert best.added is candidates["command_delay"] and best.evidence.total > other.evidence.total
    assert best.fit.values[0] == pytest.approx(0.1, rel=0.05)
    assert fitter.add_candidate(base, candidates["command_delay"]).fit is best.fit


def test_a_stall_is_fitted_with_its_delay_behind_the_angle_of_attack(stalling) -> None:
    """Within 4 sigma of the fit and a hundredth: the flight is simulated at another rate than it is predicted at."""
    fitter, base, candidates = stalling
    fit = fitter.add_candidate(base, candidates["stall_separation"]).fit
    errors = np.sqrt(np.diag(fit.covariance))
    names = [fit.simulator.names[i].partition(".")[2] for i in fit.indices]
    for name, true in {"depth": 1.0, "alpha_star": 0.17, "tau2": 8.0}.items():
        place = names.index(name)
        assert abs(fit.values[place] - true) < 4.0 * errors[place] + 0.01 * true
        assert errors[place] < 0.1 * true


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
    (found,) = CandidateFitter(fitter.nuisances, Checkpoint()).screen(base, [endless], silent)
    assert found.deviance == np.inf and found.candidate is endless


def test_upon_an_explanation_that_is_far_behind_only_what_may_catch_up_is_screened(late) -> None:
    """Truth: late commands. Without them another inertia leaves much, of which a thrust can remove nothing."""
    known, base, candidates = late
    fitter = CandidateFitter(known.nuisances, Checkpoint())
    fitter.fit_set(base.fit, [])
    wanted = [candidates[label] for label in ("command_delay", "inertia_error", "thrust_scale")]
    fitter.screen_upon([base], wanted, silent)
    best, behind = (fitter.add_candidate(base, each) for each in wanted[:2])
    pairs = fitter.screen_upon([best, behind], wanted, silent)
    tried = {(pair.explanation.added.label, pair.screened.candidate.label) for pair in pairs}
    assert behind.deviance - best.deviance > 100.0
    assert {("command_delay", "inertia_error"), ("command_delay", "thrust_scale")} <= tried
    assert ("inertia_error", "thrust_scale") not in tried
    assert "command_delay" in fitter.screened[frozenset({"inertia_error"})]


def test_the_deviance_of_a_fit_is_that_which_screening_compares_with(late) -> None:
    """By another route: nuisance parameters that are projected out have nowhere better to go where a fit has ended."""
    fitter, base, candidates = late
    for fitted in (base, fitter.add_candidate(base, candidates["command_delay"])):
        assert fitted.deviance == pytest.approx(VariableProjection(fitted.fit).deviance(fitted.fit.values), abs=0.3)
