"""What the verdict depends on, measured; truth: predictions moved by a sample, and a diagnosis's own parts."""

import numpy as np

from sysid_node.gap.verdict.decision import decide
from sysid_node.gap.verdict.measurement import measure, sampling_power


def test_sampling_leaves_what_its_standard_deviation_of_a_delay_leaves(lagging) -> None:
    """Truth: the prediction itself, its commands and air data moved by 1 / sqrt(12) of a sample, without a slope."""
    fit = lagging.attribution.chosen.fit
    model, point = fit.flights[0].model, fit.flights[0].point
    shifted = np.zeros(6)
    for clock in ("actuator_stamp_delay.delay", "air_data_delay.delay"):
        late = point.copy()
        late[model.simulator.names.index(clock)] += 0.01 / np.sqrt(12.0)  # s
        shifted += np.sum(np.abs(model.predicted(late) - model.predicted(point))[:, 1:, :6] ** 2, axis=(0, 1))
    motion = np.sum(np.abs(model.measured)[:, 1:, :6] ** 2, axis=(0, 1))
    np.testing.assert_allclose(sampling_power(fit)[:6], shifted / motion, rtol=0.2)


def test_the_table_gives_the_verdict_of_the_diagnosis(lagging) -> None:
    scores = measure(lagging.models, lagging.attribution, lagging.check)
    assert decide(scores) == lagging.decision
    assert lagging.verdict == "explained" and lagging.decision.causes == ("actuator_lag",)


def test_the_table_holds_what_was_measured(lagging) -> None:
    scores = measure(lagging.models, lagging.attribution, lagging.check)
    (cause,) = scores.causes
    assert scores.signal_to_noise > 100.0 and scores.externally_excited and not scores.weather_suffices
    assert (cause.power_removed <= scores.power_before * (1.0 + 1e-12)).all()
    assert scores.power_after.sum() < scores.power_before.sum() < scores.motion.sum()
    assert scores.simulation is not None
    assert scores.simulation.after_lower <= scores.simulation.after == lagging.simulation_gap.after
