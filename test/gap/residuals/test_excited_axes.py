"""Which motions the commands excite. Truth: flights in which some surfaces were held."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.gap.residuals.excited_axes import (
    effective_number,
    excited_channels,
    excited_motions,
    excited_windows,
    of_motions,
    quiet_motions,
)
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel


def flown_with(model: ResidualModel, *symbols: str) -> ResidualModel:
    """The flight with all surfaces but these, and the throttle, held at their means."""
    commands = np.array(model.inputs.signals.commands)
    for column, symbol in enumerate((*model.simulator.aircraft.control_symbols, "thrust")):
        if symbol not in symbols:
            commands[:, column] = commands[:, column].mean()
    signals = model.inputs.signals._replace(commands=jnp.asarray(commands))
    return replace(model, inputs=model.inputs._replace(signals=signals))


@pytest.mark.parametrize(
    ("moved", "excited"),
    [
        (("de", "da", "dr", "thrust"), {"longitudinal", "lateral"}),
        (("de",), {"longitudinal"}),
        (("da",), {"lateral"}),
        (("dr",), {"lateral"}),
        ((), {"longitudinal", "lateral"}),  # nothing was commanded: nothing is left out
    ],
)
def test_a_motion_is_excited_by_the_surfaces_that_command_it(plain_model, moved, excited) -> None:
    model = flown_with(plain_model, *moved)
    assert excited_motions([model]) == excited
    assert set(quiet_motions([model])) == {"longitudinal", "lateral"} - excited
    assert excited_motions([model, plain_model]) == {"longitudinal", "lateral"}


def test_channels_belong_to_their_motion(plain_model) -> None:
    lateral = excited_channels([flown_with(plain_model, "da")])
    assert {name for name, own in zip(CHANNELS, lateral, strict=True) if own} == {
        "CY",
        "Cl",
        "Cn",
        "beta",
        "phi",
        "psi",
    }
    np.testing.assert_array_equal(of_motions(("q", "p", "V"), frozenset({"longitudinal"})), [True, False, True])


def test_what_was_not_measured_is_not_listed_as_quiet(plain_model) -> None:
    model = flown_with(plain_model, "de")
    in_plane = replace(model, measurement=model.measurement, flight=replace(model.flight, lateral=False))
    assert quiet_motions([in_plane]) == []


def test_a_motion_that_hardly_moves_beside_another_flight_of_the_same_aircraft_is_quiet(plain_model) -> None:
    """A small rudder manoeuvre, in which the elevator holds, beside one with large ailerons."""
    rolling, holding = flown_with(plain_model, "da"), flown_with(plain_model, "de")
    commands = np.array(holding.inputs.signals.commands)
    commands[:, 0] *= 0.01
    signals = holding.inputs.signals._replace(commands=jnp.asarray(commands))
    holding = replace(holding, inputs=holding.inputs._replace(signals=signals))
    assert excited_motions([holding]) == {"longitudinal"}
    assert excited_motions([rolling, holding]) == {"lateral"}


def test_windows_are_counted_by_what_is_commanded_in_them(plain_model) -> None:
    """By hand: n equal parts count n, one alone one; two axes, each in another part, two."""
    assert effective_number(np.ones((7, 3))) == pytest.approx(7.0)
    assert effective_number(np.eye(5)[:, [2, 2, 2]]) == pytest.approx(1.0)
    assert effective_number(np.eye(6)[:, [1, 4, 4]] * [1.0, 0.0, 0.3]) == pytest.approx(2.0)
    assert effective_number(np.zeros((4, 3))) == 4.0
    assert 0.8 * plain_model.windows.count < excited_windows([plain_model]) <= plain_model.windows.count
