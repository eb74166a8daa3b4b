"""Each effect follows its equation, by numbers computed independently of the simulator."""

import jax.numpy as jnp
import numpy as np
import pytest
from plain import DERIVATIVES, three_axes
from scipy.signal import lsim

from sysid_node.sim import EFFECTS, STATIONS, trim_flight
from sysid_node.sim.effects import ground_effect, stall_separation
from sysid_node.sim.flying.rollout import settled
from sysid_node.sim.model.chain import Chain, derivative, drive_of
from sysid_node.sim.stations import actuator

SAMPLES = 301

DESIGN = {
    "command": "command_delay",
    "actuator": "actuator_lag actuator_rate_limit actuator_backlash actuator_bias control_effectiveness_loss "
    "stuck_surface",
    "airflow": "steady_wind turbulence gust",
    "aerodynamics": "derivative_error nonlinear_pitching_moment stall_separation unsteady_aerodynamics "
    "lateral_alpha_coupling control_nonlinearity drag_rise lateral_asymmetry ground_effect",
    "propulsion": "thrust_scale thrust_line_offset thrust_yaw propwash motor_lag",
    "mass": "mass_error inertia_error cg_shift",
    "structure": "structural_mode",
    "sensors": "imu_bias imu_scale imu_misalignment imu_lever_arm airspeed_scale vane_bias vane_scale vane_lever_arm "
    "air_data_lag sensor_noise",
    "clock": "imu_delay air_data_delay actuator_stamp_delay",
}


def test_the_table_is_complete_and_described(simulator):
    assert {s: sorted(e.name for e in EFFECTS.values() if e.station == s) for s in STATIONS} == {
        s: sorted(names.split()) for s, names in DESIGN.items()
    }
    for effect in EFFECTS.values():
        assert effect.summary and effect.equation and any(c.isdigit() for c in effect.source), effect.name
        parameters = effect.parameters(simulator.layout)
        assert any(p.switch for p in parameters), effect.name
        for p in parameters:
            assert p.unit and p.meaning and p.scale > 0 and p.lower <= p.neutral <= p.upper, f"{effect.name}.{p.name}"


class Trimmed:
    """The neutral trim, and instants and flights from it with effects."""

    def __init__(self, simulator):
        self.simulator, self.trim = simulator, trim_flight(simulator)
        self.rest = self.instant([])

    def instant(self, effects):
        """Rates of the state, and the motion, at the neutral trim but with these effects."""
        simulator, initial = self.simulator, jnp.asarray(self.trim.initial)
        theta = jnp.asarray(simulator.vector(effects))
        chain = Chain.of(simulator.layout, simulator.model, theta, jnp.asarray(0.01), -initial[2])
        rest = actuator.start(simulator.model, jnp.asarray(self.trim.command[:-1]))
        drive, _ = drive_of(chain, rest.position, jnp.asarray(self.trim.command[-1]), jnp.zeros(6), jnp.zeros(()))
        return derivative(chain, settled(chain, initial, drive), drive)

    def fly(self, effects, deflections=None, **inputs):
        moves = np.zeros((SAMPLES, 4)) if deflections is None else deflections
        commands = self.simulator.inputs(self.trim.command + moves, **inputs)
        return self.simulator.rollout(self.simulator.vector(effects), self.trim.initial, commands)

    def outputs(self, effects, deflections=None, **inputs):
        flight = self.fly(effects, deflections, **inputs)
        return dict(zip(self.simulator.outputs, np.asarray(flight.outputs).T, strict=True))


@pytest.fixture(scope="module")
def trimmed(simulator):
    return Trimmed(simulator)


@pytest.fixture(scope="module")
def moves(simulator):
    return three_axes(SAMPLES, simulator.step)


TIME = np.arange(SAMPLES) * 0.01


# actuator


def test_actuator_lag_is_the_first_order_answer(trimmed, moves):
    surfaces = np.asarray(trimmed.fly(["actuator_lag:time_constant=0.08"], moves).surfaces)
    _, expected, _ = lsim(([1.0], [0.08, 1.0]), moves[:, 0], TIME)  # interpolates its input linearly, as we do
    np.testing.assert_allclose(surfaces[:, 0] - trimmed.trim.command[0], expected, atol=1e-9)


def test_actuator_rate_limit_is_kept(trimmed, moves):
    surfaces = np.asarray(trimmed.fly(["actuator_rate_limit:rate=0.5"], moves).surfaces)[:, :3]
    speed = np.abs(np.diff(surfaces, axis=0)) / 0.01
    assert 0.495 < speed.max() <= 0.5 + 1e-12


def test_backlash_holds_the_surface_within_its_play(trimmed):
    wave = np.zeros((SAMPLES, 4))
    wave[:, 0] = 0.05 * np.sin(2 * np.pi * TIME)
    surfaces = np.asarray(trimmed.fly(["actuator_backlash:elevator=0.03"], wave).surfaces)[:, 0]
    off = surfaces - trimmed.trim.command[0]
    assert off[100:].max() == pytest.approx(0.05 - 0.015, abs=1e-3)  # amplitude less half the width
    assert np.abs(wave[:, 0] - off).max() == pytest.approx(0.015, abs=1e-3)
    after_peak = (TIME > 1.26) & (TIME < 1.33)  # it stands still while the play is taken up
    assert np.ptp(off[after_peak]) < 1e-4


def test_bias_loss_and_jam(trimmed, moves):
    plain = np.asarray(trimmed.fly([], moves).surfaces)
    biased = np.asarray(trimmed.fly(["actuator_bias:rudder=0.02"], moves).surfaces)
    np.testing.assert_allclose(biased[:, 2], plain[:, 2] + 0.02, atol=1e-12)
    jammed = np.asarray(trimmed.fly(["stuck_surface:aileron=1:aileron_position=0.03:onset=1"], moves).surfaces)
    assert jammed[200:, 1] == pytest.approx(0.03, abs=1e-6)
    np.testing.assert_allclose(jammed[:50, 1], plain[:50, 1], atol=1e-3)
    _, motion = trimmed.instant(["control_effectiveness_loss:elevator=0.4"])
    lost = -0.4 * trimmed.trim.command[0] * DERIVATIVES["Cm_de"]
    assert motion.coefficients.Cm - trimmed.rest[1].coefficients.Cm == pytest.approx(lost)


# command and clock


def test_delays_shift(trimmed, moves):
    late = np.vstack([np.zeros((4, 4)), moves[:-4]])
    direct, delayed = trimmed.fly([], late), trimmed.fly(["command_delay:delay=0.04"], moves)
    np.testing.assert_allclose(delayed.outputs, direct.outputs, atol=1e-9)
    early = trimmed.fly(["command_delay:delay=0.04", "actuator_stamp_delay:delay=0.04"], moves)
    np.testing.assert_allclose(early.outputs, trimmed.fly([], moves).outputs, atol=1e-9)
    imu = np.asarray(trimmed.fly(["imu_delay:delay=0.03", "air_data_delay:delay=-0.02"], moves).outputs)
    plain = np.asarray(trimmed.fly([], moves).outputs)
    np.testing.assert_allclose(imu[3:, :9], plain[:-3, :9], atol=1e-12)
    np.testing.assert_allclose(imu[:-2, 9:], plain[2:, 9:], atol=1e-12)


# airflow


def test_steady_wind_moves_the_ground_track_only(trimmed):
    calm, windy = trimmed.fly([]), trimmed.fly(["steady_wind:north=5:east=-3"])
    np.testing.assert_allclose(windy.outputs, calm.outputs, atol=1e-9)
    drift = np.asarray(windy.states - calm.states)[-1, :2]
    np.testing.assert_allclose(drift, [5 * TIME[-1], -3 * TIME[-1]], rtol=1e-9)


def test_gusts_are_met(trimmed):
    calm = trimmed.outputs([])
    gusty = trimmed.outputs(["gust:forward=-2:start=0.5:length=7.2"])  # 0.4 s at 18 m/s, a head wind
    met = gusty["V"] - calm["V"]
    assert met[70] == pytest.approx(2.0, rel=0.03)  # half way through; the aircraft has hardly slowed down
    assert np.abs(met[:50]).max() < 1e-12
    unit = np.zeros((SAMPLES, 6))
    unit[:, 0] = 1.0
    slower = trimmed.outputs(["turbulence:intensity=2"], turbulence=unit)  # air moving forward with 2 m/s
    assert slower["V"][0] - calm["V"][0] == pytest.approx(-2.0, rel=0.01)


# aerodynamics


@pytest.mark.parametrize(
    ("effect", "coefficient", "size"),
    [
        ("derivative_error:Cm_alpha=0.2", "Cm", lambda t: 0.2 * t.trim.alpha),
        ("lateral_asymmetry:Cl_0=0.003", "Cl", lambda t: 0.003),
        ("lateral_asymmetry:Cn_0=-0.002", "Cn", lambda t: -0.002),
        ("drag_rise:parabola=5", "CD", lambda t: 5 * (t.rest[1].coefficients.CL - t.simulator.model.lift) ** 2),
        ("control_nonlinearity:elevator=20", "Cm", lambda t: -20 * t.trim.command[0] ** 3 * DERIVATIVES["Cm_de"]),
        (
            "nonlinear_pitching_moment:quadratic=9:cubic=50",
            "Cm",
            lambda t: 9 * off(t) ** 2 + 50 * off(t) ** 3,
        ),
    ],
)
def test_coefficients_gain(trimmed, effect, coefficient, size):
    _, motion = trimmed.instant([effect])
    gained = getattr(motion.coefficients, coefficient) - getattr(trimmed.rest[1].coefficients, coefficient)
    assert gained == pytest.approx(float(size(trimmed)), rel=1e-9, abs=1e-15)


def off(t: Trimmed) -> float:
    return t.trim.alpha - float(t.simulator.model.alpha)


def test_kirchhoff_lift_and_its_hysteresis():
    values = {p.name: p.neutral for p in EFFECTS["stall_separation"].parameters(None)} | {"depth": 1.0}
    factor = [float(stall_separation.lift_factor(values, jnp.asarray(x))) for x in (1.0, 0.25, 0.0)]
    assert factor == pytest.approx([1.0, 0.5625, 0.25], abs=2e-4)  # ((1 + sqrt X) / 2)^2
    half = stall_separation.attached(values, jnp.asarray(0.26), jnp.asarray(0.0), jnp.asarray(0.02))
    assert half == pytest.approx(0.5)
    rising = stall_separation.attached(values, jnp.asarray(0.26), jnp.asarray(1.0), jnp.asarray(0.02))
    assert rising == pytest.approx(0.5 * (1 + np.tanh(20 * 3 * 0.02)))  # separation comes late


def test_alpha_rate_is_solved_with_its_own_lift(trimmed):
    effects = ["unsteady_aerodynamics:CL_alphadot=4:Cm_alphadot=-6", "actuator_bias:elevator=-0.2"]
    rates, motion = trimmed.instant(effects)
    plain = trimmed.instant(effects[1:])[1]
    u, w, du, dw = trimmed.trim.initial[3], trimmed.trim.initial[5], float(rates[3]), float(rates[5])
    reduced = (u * dw - w * du) / (u * u + w * w) * 0.28 / (2 * 18.0)
    assert abs(reduced) > 1e-3
    lift, moment = (getattr(motion.coefficients, c) - getattr(plain.coefficients, c) for c in ("CL", "Cm"))
    assert (lift, moment) == pytest.approx((4 * reduced, -6 * reduced), rel=1e-9)


def test_lateral_coupling_turns_with_alpha(trimmed):
    chain_at = trimmed.simulator.initial(18.0, trimmed.trim.alpha + 0.05, 0.1, (0.0, 0.1, 0.0), altitude=200.0)
    outcome = []
    for effects in ([], ["lateral_alpha_coupling:Cl_beta_alpha=-0.5:Cn_beta_alpha=0.3"]):
        theta = jnp.asarray(trimmed.simulator.vector(effects) if effects else trimmed.simulator.neutral())
        flight = trimmed.simulator.rollout(
            theta, chain_at, trimmed.simulator.inputs(np.tile(trimmed.trim.command, (SAMPLES, 1)))
        )
        outcome.append(np.asarray(flight.coefficients[0]))
    alpha = off(trimmed) + 0.05
    np.testing.assert_allclose(
        outcome[1][[3, 5]] - outcome[0][[3, 5]], [-0.5 * 0.1 * alpha, 0.3 * 0.1 * alpha], rtol=1e-9
    )


def test_ground_effect_fades_with_height():
    values = {"height": jnp.asarray(0.5)}
    share = [float(ground_effect.share(values, jnp.asarray(climb), jnp.asarray(1.8))) for climb in (-0.5, 0.0, 50.0)]
    assert share == pytest.approx([1.0, 1 / (1 + (16 * 0.5 / 1.8) ** 2), 0.0], abs=1e-5)


# propulsion and mass


@pytest.mark.parametrize(
    ("effect", "axis", "moment"),
    [
        ("thrust_line_offset:arm=0.05", 1, lambda t: 0.05 * t.trim.command[-1]),
        ("thrust_yaw:torque_arm=0.02", 0, lambda t: 0.02 * t.trim.command[-1]),
        ("thrust_yaw:p_factor=0.3", 2, lambda t: 0.3 * t.trim.alpha * t.trim.command[-1]),
        # a CG forward of where the lift acts (level flight: as large as the weight) is nose-heavy
        ("cg_shift:x=0.02", 1, lambda t: 0.02 * 4.0 * t.rest[1].specific_force.z),
    ],
)
def test_moments_gained(trimmed, effect, axis, moment):
    rates, _ = trimmed.instant([effect])
    Ixx, Iyy, Izz, Ixz = np.asarray(trimmed.simulator.model.inertia)
    inertia = np.array([[Ixx, 0, -Ixz], [0, Iyy, 0], [-Ixz, 0, Izz]])
    gained = inertia @ np.asarray(rates[10:13])
    expected = np.zeros(3)
    expected[axis] = moment(trimmed)
    np.testing.assert_allclose(gained, expected, atol=1e-8)


def test_thrust_mass_and_inertia(trimmed):
    _, motion = trimmed.instant(["thrust_scale:error=0.5"])
    gained = motion.specific_force.x - trimmed.rest[1].specific_force.x
    assert gained == pytest.approx(0.5 * trimmed.trim.command[-1] / 4.0)
    _, heavy = trimmed.instant(["mass_error:error=0.25"])
    assert heavy.specific_force.z == pytest.approx(float(trimmed.rest[1].specific_force.z) / 1.25)
    effects = ["actuator_bias:elevator=-0.02"]
    light, inert = trimmed.instant(effects), trimmed.instant([*effects, "inertia_error:Iyy=0.6"])
    assert inert[0][11] == pytest.approx(float(light[0][11]) / 1.6)


def test_propwash_strengthens_the_tail(trimmed):
    _, motion = trimmed.instant(["propwash:gain=2"])
    air = motion.air
    factor = 2 * trimmed.trim.command[-1] / float(air.pressure * 0.5)
    gained = motion.coefficients.Cm - trimmed.rest[1].coefficients.Cm
    assert gained == pytest.approx(factor * DERIVATIVES["Cm_de"] * trimmed.trim.command[0])


def test_motor_lag(trimmed):
    power = np.zeros((SAMPLES, 4))
    power[:, 3] = 3.0 * (TIME >= 1.0)
    thrust = np.asarray(trimmed.fly(["motor_lag:time_constant=0.4"], power).surfaces)[:, 3] - trimmed.trim.command[3]
    assert thrust[140] == pytest.approx(3.0 * (1 - np.exp(-1)), rel=0.02)


# structure and sensors


def test_structural_mode_rings_at_its_frequency(trimmed):
    pull = np.zeros((SAMPLES, 4))
    pull[:, 0] = -0.05 * (TIME >= 0.5)
    effects = ["structural_mode:gain=0.2:frequency=6:damping=0.03"]
    ringing = (trimmed.outputs(effects, pull)["az"] - trimmed.outputs([], pull)["az"])[120:]
    crossings = np.flatnonzero(np.diff(np.signbit(ringing)))
    assert 0.5 / (np.diff(crossings).mean() * 0.01) == pytest.approx(6.0, rel=0.03)
    early, late = np.abs(ringing[:40]).max(), np.abs(ringing[117:157]).max()  # seven periods apart
    assert np.log(early / late) / (2 * np.pi * 7) == pytest.approx(0.03, rel=0.25)


def test_inertial_readings(trimmed, moves):
    plain = trimmed.outputs([], moves)
    read = lambda *effects: trimmed.outputs(list(effects), moves)  # noqa: E731
    np.testing.assert_allclose(read("imu_bias:ax=0.3")["ax"], plain["ax"] + 0.3, atol=1e-12)
    np.testing.assert_allclose(read("imu_bias:q=-0.02")["q"], plain["q"] - 0.02, atol=1e-12)
    np.testing.assert_allclose(read("imu_scale:az=0.05")["az"], plain["az"] * 1.05, atol=1e-12)
    tilted = read("imu_misalignment:pitch=0.03")
    np.testing.assert_allclose(tilted["ax"], plain["ax"] - 0.03 * plain["az"], atol=1e-12)
    ahead = read("imu_lever_arm:x=0.3")
    p, q, r = plain["p"], plain["q"], plain["r"]
    np.testing.assert_allclose(ahead["ax"], plain["ax"] - 0.3 * (q**2 + r**2), atol=1e-9)
    error = ahead["az"] - plain["az"] - 0.3 * p * r + 0.3 * np.gradient(q, 0.01)
    assert np.quantile(np.abs(error), 0.9) < 2e-3  # all but where a step's edge spoils the difference


def test_air_data_readings(trimmed, moves):
    plain = trimmed.outputs([], moves)
    read = lambda *effects: trimmed.outputs(list(effects), moves)  # noqa: E731
    np.testing.assert_allclose(read("airspeed_scale:error=0.1")["V"], 1.1 * plain["V"], rtol=1e-12)
    np.testing.assert_allclose(read("vane_bias:alpha=0.01")["alpha"], plain["alpha"] + 0.01, rtol=1e-12)
    np.testing.assert_allclose(read("vane_scale:beta=0.2")["beta"], 1.2 * plain["beta"], atol=1e-12)
    moved = read("vane_lever_arm:x=0.5")["alpha"] - plain["alpha"]
    np.testing.assert_allclose(moved, -0.5 * plain["q"] / plain["V"], atol=1.5e-4)
    _, lagged, _ = lsim(([1.0], [0.1, 1.0]), plain["alpha"] - plain["alpha"][0], TIME)
    np.testing.assert_allclose(read("air_data_lag:time_constant=0.1")["alpha"] - plain["alpha"][0], lagged, atol=1e-9)


def test_noise_has_the_files_sigma(trimmed):
    unit = np.random.default_rng(3).standard_normal((SAMPLES, 12))
    noisy = trimmed.fly(["sensor_noise:scale=2"], noise=unit).outputs
    clean = trimmed.fly([]).outputs
    np.testing.assert_allclose(noisy - clean, 2 * np.asarray(trimmed.simulator.model.noise) * unit, atol=1e-12)


def test_rate_limit_by_its_inverse_is_the_same(simulator):
    np.testing.assert_array_equal(
        simulator.vector(["actuator_rate_limit:rate=0.5"]), simulator.vector(["actuator_rate_limit:inverse_rate=2"])
    )
