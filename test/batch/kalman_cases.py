"""What the tests of the three Kalman filters share: the published HFB-320 case and a short period of known truth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from made_models import NOISE, SHORT_PERIOD, flown, noisy, short_period_model
from reference_flights import HFB_FILTER_NOISE, ReferenceCase, hfb_320

from sysid_node.batch.likelihood.joint_kalman_filter import FilterNoise
from sysid_node.batch.methods.output_error import output_error
from sysid_node.batch.results.parameter_track import ParameterTrack

Filter = Callable[..., ParameterTrack]


def published_case(flights: Path) -> tuple[ReferenceCase, FilterNoise]:
    """The HFB-320 with the noise variances of the published runs; those programs add q / dt at every step."""
    case = hfb_320(flights)
    sensor, process = (np.array(variances) for variances in HFB_FILTER_NOISE)
    return case, FilterNoise(process / case.manoeuvre.step**2, sensor, np.full(15, np.sqrt(10.0)))


def assert_near_maximum_likelihood(method: Filter) -> None:
    """Without process noise the final estimates are those of maximum likelihood, within its standard errors."""
    start = {name: 0.8 * value for name, value in SHORT_PERIOD.items()}
    manoeuvre = noisy(flown(short_period_model()), np.random.default_rng(1))
    deviation = np.array([1e-4, 1e-4, *(0.3 * abs(v) for v in SHORT_PERIOD.values())])
    track = method(short_period_model(start), [manoeuvre], FilterNoise(np.zeros(2), NOISE**2, deviation))
    best = output_error(short_period_model(), [manoeuvre])
    for name, estimate in track.final.items():
        assert abs(estimate.value - best.values[name]) < best.estimates[name].white_error, name
        assert abs(estimate.standard_error / best.estimates[name].white_error - 1.0) < 0.25, name
    assert track.values.shape == track.errors.shape == (len(manoeuvre), 5)
    assert (track.errors[-1] < track.errors[0]).all()
