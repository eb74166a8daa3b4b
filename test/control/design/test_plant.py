"""The linear models against the simulator, of which they are the derivative near level flight."""

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.control.design import plant
from sysid_node.dynamics.linear_model import DimensionalScales
from sysid_node.dynamics.linearised import trimmed
from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying.rollout import settled
from sysid_node.sim.model.chain import Chain, derivative, drive_of
from sysid_node.sim.stations import actuator, propulsion

AIRCRAFT = load_aircraft("cdrw")
VALUES = {name: d.value for name, d in AIRCRAFT.derivatives.items()}
CONDITION = DimensionalScales.of(AIRCRAFT, AIRCRAFT.reference.airspeed, AIRCRAFT.reference.air_density)


@pytest.fixture(scope="module")
def slopes() -> tuple[np.ndarray, np.ndarray]:
    """d(alpha, q, beta, p, r)/dt of the six-degree-of-freedom simulator in trim, by themselves and by surfaces."""
    simulator = Simulator(AIRCRAFT, 100.0)
    trim = trim_flight(simulator)
    V = float(AIRCRAFT.reference.airspeed)

    def rates(z: np.ndarray) -> np.ndarray:
        alpha, q, beta, p, r = z[:5]
        euler = (0.0, trim.alpha, 0.0)
        initial = simulator.initial(V, trim.alpha + alpha, beta, euler, (p, q, r), -float(trim.initial[2]))
        chain = Chain.of(simulator.layout, simulator.model, jnp.asarray(simulator.neutral()), 0.01, -initial[2])
        command = jnp.asarray(trim.command).at[:3].add(z[5:])
        zero = jnp.zeros(())
        motor = propulsion.commanded(simulator.model, command[-1])
        drive, _ = drive_of(chain, actuator.start(simulator.model, command[:-1]).position, motor, jnp.zeros(6), zero)
        d = np.asarray(derivative(chain, settled(chain, initial, drive), drive)[0])
        u_dot, v_dot, w_dot = d[3:6]
        a = trim.alpha + alpha
        alpha_dot = (w_dot * np.cos(a) - u_dot * np.sin(a)) / (V * np.cos(beta))
        return np.array([alpha_dot, d[11], v_dot / (V * np.cos(beta)), d[10], d[12]])

    steps = 1e-4 * np.eye(8)
    slopes = np.column_stack([(rates(step) - rates(-step)) / 2e-4 for step in steps])
    return slopes[:, :5], slopes[:, 5:]


def test_longitudinal_model_is_the_simulators_slope(slopes: tuple[np.ndarray, np.ndarray]) -> None:
    A, B = slopes
    found = plant.longitudinal(VALUES, CONDITION)
    # the simulator's drag and thrust turn the lift curve a little: the model leaves them out
    np.testing.assert_allclose(found.A, A[:2, :2], rtol=0.03, atol=0.02)
    np.testing.assert_allclose(found.B, B[:2, :1], rtol=0.01)


def test_lateral_model_is_the_simulators_slope(slopes: tuple[np.ndarray, np.ndarray]) -> None:
    A, B = slopes
    alpha, _ = trimmed(AIRCRAFT)
    found = plant.lateral(VALUES, CONDITION, alpha)
    np.testing.assert_allclose(found.A[:3, :3], A[2:, 2:], rtol=0.01, atol=0.02)
    np.testing.assert_allclose(found.B[:3], B[2:, 1:], rtol=0.01, atol=1e-3)
    assert found.A[0, 3] == pytest.approx(9.80665 / 18.0, rel=0.01)


def test_many_aircraft_at_once_are_each_of_them() -> None:
    several = {name: np.array([value, 1.2 * value]) for name, value in VALUES.items()}
    both = plant.lateral(several, CONDITION, 0.08)
    one = plant.lateral({name: 1.2 * value for name, value in VALUES.items()}, CONDITION, 0.08)
    np.testing.assert_allclose(both.A[1], one.A)
    np.testing.assert_allclose(both.B[1], one.B)


def test_a_file_that_lacks_what_control_needs_is_refused() -> None:
    lacking = load_aircraft("cdrw")
    derivatives = {name: d for name, d in lacking.derivatives.items() if name != "Cm_de"}
    with pytest.raises(InputError, match="Cm_de"):
        plant.check(type(lacking)(**{**vars(lacking), "derivatives": derivatives}))
