"""Whether an explanation stands, from errors made by hand; truth: each rule, tie and boundary."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.standing import (
    ErrorTable,
    attitude_errors,
    causes_exceed_weather,
    causes_stand,
    channel_ratio,
    file_derivatives_suit_causes,
    file_predicts_better,
    is_needless,
    shares_taken_away,
    weather_accounts_for,
)

GOOD = ErrorTable(before=1.0, tolerances=0.5, after=0.1)


@pytest.mark.parametrize(
    ("errors", "stand"),
    [
        ([GOOD], True),
        ([GOOD, GOOD], True),
        ([GOOD, GOOD._replace(after=0.6)], True),  # better than the derivatives by one measure is enough
        ([GOOD._replace(after=0.6)], False),
        ([GOOD, GOOD._replace(after=1.1)], False),  # worse than the file by one measure is not
        ([GOOD._replace(after=0.6), GOOD._replace(after=0.6)], False),
        ([GOOD._replace(after=0.5)], False),  # a tie with the derivatives
        ([GOOD, GOOD._replace(tolerances=2.0, after=1.0)], True),  # a tie with the file beside a large improvement
        ([GOOD._replace(after=0.75, tolerances=0.8), GOOD._replace(after=1.0)], False),  # beside a small one
        ([GOOD, GOOD._replace(after=1.06)], False),
        ([GOOD._replace(tolerances=2.0, after=0.9)], True),
        ([GOOD._replace(after=float("nan"))], False),
    ],
)
def test_causes_predict_better_than_derivatives_and_file(errors: list[ErrorTable], stand: bool) -> None:
    assert causes_stand(errors) is stand


def test_derivatives_that_nothing_excuses_may_predict_a_little_better() -> None:
    close = GOOD._replace(after=0.52)
    assert causes_stand([close], derivatives_plausible=False)
    assert not causes_stand([close])
    assert not causes_stand(
        [GOOD._replace(after=0.5 * THRESHOLDS.validation.implausible_derivatives)], derivatives_plausible=False
    )
    assert not causes_stand([close._replace(before=0.5)], derivatives_plausible=False)


def test_what_causes_take_away_of_a_reading_on_other_flight_is_no_weather() -> None:
    """A gyro that reads a quarter too little doubles the error of q; weather is alike with it and without it."""
    readings = {
        "q": {"before": 1.0, "tolerances": 1.2, "after": 0.5},
        "alpha": {"before": 0.6, "tolerances": 0.5, "after": 0.5},
    }
    assert shares_taken_away(readings) == pytest.approx((0.75, 0.0))
    assert causes_exceed_weather(shares_taken_away(readings))
    limit = THRESHOLDS.validation.beyond_weather
    assert not causes_exceed_weather((limit,)) and causes_exceed_weather((limit + 1e-9,))
    assert not causes_exceed_weather(())


def test_a_gyros_bias_is_seen_in_the_attitude_where_gusts_hide_it_elsewhere() -> None:
    hidden = [ErrorTable(1.42, 1.25, 1.24), ErrorTable(0.614, 0.626, 0.624)]
    found = attitude_errors({"theta": {"before": 1.52, "tolerances": 1.52, "after": 0.015}, "q": {}})
    assert found == {"theta": ErrorTable(1.52, 1.52, 0.015)}
    assert causes_stand(hidden, [*found.values()]) and not causes_stand(hidden)
    worse = [hidden[0], ErrorTable(0.614, 0.626, 0.65)]
    assert not causes_stand(worse, [*found.values()])


def test_causes_may_be_worse_by_frequency_where_they_halve_the_product_of_both_errors() -> None:
    """Truth: a mass 15 % off, as flights without vanes show it."""
    by_frequency, flown = ErrorTable(0.261, 0.308, 0.299), ErrorTable(0.705, 0.164, 0.128)
    assert causes_stand([by_frequency, flown])
    most = THRESHOLDS.validation.product * flown.before * by_frequency.before / flown.after
    assert causes_stand([by_frequency._replace(after=0.999 * most), flown])
    assert not causes_stand([by_frequency._replace(after=1.001 * most), flown])
    assert not causes_stand([by_frequency, flown._replace(tolerances=0.7, after=0.6)])


def test_an_attitude_that_the_gyroscopes_give_says_nothing() -> None:
    small = {"before": THRESHOLDS.acceptance.noticeable_error, "tolerances": 0.05, "after": 0.01}
    assert attitude_errors({"phi": small}) == {}


@pytest.mark.parametrize(("tolerances", "better"), [(0.9, False), (1.0, False), (1.0 + 1e-12, True)])
def test_the_file_predicts_better_by_one_measure(tolerances: float, better: bool) -> None:
    worse = GOOD._replace(tolerances=tolerances)
    assert file_predicts_better([worse]) is file_predicts_better([GOOD, worse]) is better


@pytest.mark.parametrize(
    ("by_frequency", "of_short_flights", "better"),
    [
        (1.04, 0.69, False),  # a tie beside a large improvement on short flights
        (1.06, 0.69, True),
        (1.04, 0.71, True),  # beside a small one
        (0.69, 1.04, True),  # gusts bias derivatives, which then predict better by frequency
        (1.6, 0.3, False),  # the file flies three times as far off, and the product of both errors is halved
        (1.7, 0.3, True),  # it is not
    ],
)
def test_a_tie_by_frequency_does_not_keep_a_file_that_flies_far_off(
    by_frequency: float, of_short_flights: float, better: bool
) -> None:
    errors = [ErrorTable(1.0, by_frequency, 0.1), ErrorTable(1.0, of_short_flights, 0.1)]
    assert file_predicts_better(errors) is better


@pytest.mark.parametrize(
    ("without", "needless"),
    [((0.1, 0.1), True), ((0.05, 0.09), True), ((0.11, 0.05), False), ((0.05, 0.11), False)],
)
def test_a_cause_is_needless_where_no_measure_is_worse_without_it(without: tuple[float, ...], needless: bool) -> None:
    assert is_needless([GOOD, GOOD], [GOOD._replace(after=after) for after in without]) is needless


def by_channel(before: float, tolerances: float, after: float, **channels: tuple[float, float, float]) -> ErrorTable:
    """Errors overall and of channels, each before, within tolerances and after."""
    stages = ("before", "tolerances", "after")
    table = {name: dict(zip(stages, errors, strict=True)) for name, errors in channels.items()}
    return ErrorTable(before, tolerances, after, table)


def test_the_ratio_over_channels_is_their_geometric_mean() -> None:
    """Common channels alone count, and errors that are too small to be of interest as if they were just of interest."""
    small = THRESHOLDS.acceptance.noticeable_error
    errors = by_channel(0.5, 0.4, 0.3, p=(0.8, 0.4, 0.1), r=(0.5, 0.5, 1.0), psi=(small, 0.2 * small, 0.1 * small))
    assert channel_ratio(errors, errors, "before") == pytest.approx((0.125 * 2.0) ** (1.0 / 3.0))
    assert channel_ratio(errors, errors, "tolerances") == pytest.approx((0.25 * 2.0) ** (1.0 / 3.0))
    other = by_channel(0.5, 0.4, 0.3, p=(0.8, 0.4, 0.3), beta=(0.1, 0.1, 0.1))
    assert channel_ratio(errors, other) == pytest.approx(1.0 / 3.0)
    assert channel_ratio(errors, GOOD) == 1.0


def test_what_mends_most_channels_is_not_missed_beside_one_that_nothing_mends() -> None:
    """Truth: a lag of 0.07 s in the record of a simulated light transport, whose yaw no derivatives predict."""
    by_frequency = by_channel(0.516, 0.365, 0.516, Cl=(0.867, 0.47, 0.092), CY=(0.22, 0.15, 0.24),
                              beta=(0.63, 0.44, 0.57), Cn=(0.891, 0.66, 1.238), phi=(0.33, 0.22, 0.091))  # fmt: skip
    flown = by_channel(0.591, 0.465, 0.435, p=(0.53, 0.32, 0.107), r=(0.8, 0.56, 0.61), ay=(0.57, 0.4, 0.48))
    assert causes_stand([by_frequency, flown])
    assert not causes_stand([each._replace(per_channel={}) for each in (by_frequency, flown)])
    shorter = by_channel(0.482, 0.355, 0.379, Cl=(0.75, 0.39, 0.12), CY=(0.22, 0.16, 0.19), Cn=(0.89, 0.76, 0.9))
    flown = by_channel(0.574, 0.457, 0.473, p=(0.46, 0.27, 0.15), r=(0.79, 0.67, 0.68), ay=(0.57, 0.49, 0.54))
    assert causes_stand([shorter, flown])  # the same lag of 0.05 s: the geometric mean of its errors is 0.76 of theirs
    yaw_alone = by_channel(0.516, 0.337, 0.337, Cl=(0.867, 0.47, 0.477), CY=(0.22, 0.15, 0.15), beta=(0.63, 0.44, 0.44),
                           Cn=(0.891, 0.66, 0.66), phi=(0.33, 0.22, 0.22))  # fmt: skip
    assert not is_needless([by_frequency], [yaw_alone])
    assert is_needless([by_frequency], [yaw_alone._replace(per_channel={})])


def test_a_cause_without_which_no_short_flight_can_be_simulated_is_needed() -> None:
    assert not is_needless([GOOD, GOOD], [GOOD])
    assert is_needless([GOOD], [GOOD, GOOD._replace(after=9.0)])


@pytest.mark.parametrize(("after", "suit"), [(0.3, True), (0.4, False), (0.5, False)])
def test_the_last_measure_decides_on_the_derivatives(after: float, suit: bool) -> None:
    """That of short simulated flights, where there is one."""
    fitted = [GOOD, GOOD._replace(after=0.4)]
    assert file_derivatives_suit_causes([GOOD._replace(after=9.0), GOOD._replace(after=after)], fitted) is suit


def test_derivatives_with_which_no_short_flight_can_be_simulated_do_not_suit() -> None:
    """An error by frequency is no measure for one of short flights."""
    flies, diverges = [GOOD, GOOD._replace(after=0.4)], [GOOD]
    assert not file_derivatives_suit_causes(diverges, flies)
    assert file_derivatives_suit_causes(flies, diverges)


@pytest.mark.parametrize(("after", "suit"), [(0.37, True), (0.39, False), (0.4, False)])
def test_where_fitted_derivatives_predict_better_without_causes_the_file_must_lead_by_more_than_a_tie(
    after: float, suit: bool
) -> None:
    fitted = [GOOD._replace(after=0.4)]
    assert file_derivatives_suit_causes([GOOD._replace(after=after)], fitted, clearly=True) is suit


def test_weather_accounts_for_an_error_in_every_reading_or_not_at_all() -> None:
    floors = np.array([[1.0, 2.0], [3.0, 4.0]])  # means 2 and 3
    limit = THRESHOLDS.validation.chance**2 * np.array([2.0, 3.0])
    assert weather_accounts_for(limit, floors)
    assert not weather_accounts_for(limit * [1.0, 1.0 + 1e-12], floors)
    assert not weather_accounts_for(np.array([0.0, 100.0]), floors)
    lenient = replace(THRESHOLDS, validation=replace(THRESHOLDS.validation, chance=10.0))
    assert weather_accounts_for(np.array([0.0, 100.0]), floors, lenient)
