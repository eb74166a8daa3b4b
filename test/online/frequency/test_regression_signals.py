"""Kinematics: noise-free motion of a rigid body gives back its derivatives, wherever the sensors sit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from plant import TRUTH, exact_flight, made_aircraft
from scipy.interpolate import RegularGridInterpolator

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Inertia, LookupTable, Sensors, Throttle
from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.frequency import regression_signals
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS

LEAST_SQUARES = OnlineSettings(method="sls_rft", detect_changes=False)
FLAP = Control("flap", "df", {"flap": 1.0})


def with_derivatives(aircraft: Aircraft, **more: float) -> Aircraft:
    added = {name: Derivative(value, 0.1 * abs(value)) for name, value in more.items()}
    return replace(aircraft, derivatives={**aircraft.derivatives, **added})


def without(aircraft: Aircraft, *names: str) -> Aircraft:
    return replace(aircraft, derivatives={n: d for n, d in aircraft.derivatives.items() if n not in names})


FAR = Sensors(imu=(0.3, -0.1, 0.15), air_data=(0.7, 0.2, -0.2))
PLAIN = made_aircraft()
AIRCRAFT = {
    "all at the CG": PLAIN,
    "IMU and vanes away from the CG": made_aircraft(sensors=FAR),
    "thrust line inclined and offset": made_aircraft(throttle=Throttle("throttle", 30.0, 0.1, -0.08)),
    "no throttle in the file": made_aircraft(throttle=None),
    "large Ixz": made_aircraft(inertia=Inertia(0.16, 0.22, 0.36, -0.06)),
    "several surfaces an axis": with_derivatives(
        replace(PLAIN, controls={"flap": FLAP, **PLAIN.controls}), CL_df=0.9, CD_df=0.06, Cm_df=-0.2, Cl_df=0.05
    ),
    "a subset of regressors": without(PLAIN, "CL_q", "CD_q", "CD_de", "CY_p", "CY_r", "CY_da", "Cl_dr", "Cn_da"),
    "two coefficients alone": replace(PLAIN, derivatives={n: PLAIN.derivatives[n] for n in TRUTH if n[1] in "ln"}),
    "airspeed as a regressor": with_derivatives(PLAIN, CL_V=0.2, CD_V=-0.03, Cm_V=0.01),
    "induced drag": with_derivatives(without(PLAIN, "CD_alpha", "CD_q"), CD_k=0.05),
}
AIRCRAFT["two coefficients alone"] = with_derivatives(AIRCRAFT["two coefficients alone"], Cm_alpha=-0.5, Cm_de=-0.6)


@pytest.mark.parametrize("case", AIRCRAFT)
def test_derivatives_are_recovered(case: str) -> None:
    """Exact motion at 200 Hz with jitter: better than 1e-4 of each value, or of the largest of its coefficient."""
    aircraft = AIRCRAFT[case]
    time = np.arange(0.0, 30.0, 0.005) + np.random.default_rng(0).uniform(-0.001, 0.001, 6000)
    found = run(aircraft, LEAST_SQUARES, time, exact_flight(aircraft, time), time[-1:])[0]
    assert set(found.derivatives) == set(aircraft.derivatives)
    for name, belief in aircraft.derivatives.items():
        scale = max(abs(belief.value), 0.01)
        assert found.derivatives[name].value == pytest.approx(belief.value, abs=1e-4 * scale), name
    for name, fit in found.fits.items():
        assert fit.r_squared > 1.0 - 1e-6, name


def test_the_motion_tells_right_from_wrong() -> None:
    """The same motion with each of the effects left out of the aircraft's file is far off: the cases above can fail."""
    time = np.arange(0.0, 20.0, 0.005)
    for case, wrong in (
        ("IMU and vanes away from the CG", {"sensors": Sensors()}),
        ("thrust line inclined and offset", {"throttle": Throttle("throttle", 30.0)}),
        ("large Ixz", {"inertia": Inertia(0.16, 0.22, 0.36)}),
    ):
        aircraft = AIRCRAFT[case]
        found = run(replace(aircraft, **wrong), LEAST_SQUARES, time, exact_flight(aircraft, time), time[-1:])[0]
        errors = [abs(found.derivatives[n].value / d.value - 1.0) for n, d in aircraft.derivatives.items()]
        assert max(errors) > 0.05, case


BENDS = (0.0, 0.05, 0.1, 0.16)
TABLES = (
    LookupTable("CL", ("alpha",), (BENDS,), (0.0, 0.0, -0.03, -0.15)),
    LookupTable(
        "Cm", ("alpha", "beta"), (BENDS, (-0.1, 0.0, 0.1)), ((0.0,) * 3, (0.03, 0, -0.01), (0.02, 0, 0), (-0.03,) * 3)
    ),
    LookupTable("CD", ("V",), ((15.0, 18.0, 21.0),), (0.02, 0.0, 0.03)),
    LookupTable("CD", ("Mach",), ((0.04, 0.054, 0.06),), (0.0, 0.0, 0.05)),
    LookupTable("Cl", ("p",), ((-0.03, 0.0, 0.01, 0.03),), (-0.002, 0.0, 0.002, 0.0)),
    LookupTable("Cn", ("throttle",), ((0.1, 0.17, 0.24),), (-0.004, 0.0, 0.002)),
)


def tabulated(samples: np.ndarray) -> dict[str, np.ndarray]:
    """What ``TABLES`` add to a flight of ``PLAIN``, by NumPy and SciPy; sound in the standard atmosphere, b / 2V."""
    p, V, alpha, beta, rho = (samples[:, SAMPLE_COLUMNS.index(n)] for n in ("p", "V", "alpha", "beta", "rho"))
    throttle = samples[:, SAMPLE_COLUMNS.index("thrust")] / 30.0
    temperature = 288.15 * (rho / 1.225) ** (1.0 / (9.80665 / (287.05287 * 0.0065) - 1.0))
    mach = V / np.sqrt(1.4 * 287.05287 * temperature)
    CL, Cm, over_V, over_mach, Cl, Cn = TABLES
    held = np.column_stack([np.clip(alpha, 0.0, 0.16), np.clip(beta, -0.1, 0.1)])
    return {
        "CL": np.interp(alpha, *CL.points, CL.values),
        "Cm": RegularGridInterpolator(Cm.points, np.array(Cm.values, dtype=float))(held),
        "CD": np.interp(V, *over_V.points, over_V.values) + np.interp(mach, *over_mach.points, over_mach.values),
        "Cl": np.interp(p * PLAIN.geometry.b / (2.0 * V), *Cl.points, Cl.values),
        "Cn": np.interp(throttle, *Cn.points, Cn.values),
    }


def test_derivatives_are_recovered_on_top_of_tables() -> None:
    """Exact motion with bent tables; with the tables left out of the file, derivatives are far off.

    Induced drag is that of the whole lift.
    """
    plain = AIRCRAFT["induced drag"]
    time = np.arange(0.0, 20.0, 0.005)
    samples = exact_flight(plain, time, extra=tabulated(exact_flight(plain, time)))
    found, without_tables = (
        run(aircraft, LEAST_SQUARES, time, samples, time[-1:])[0].derivatives
        for aircraft in (replace(plain, tables=TABLES), plain)
    )
    errors = {n: abs(found[n].value - d.value) / max(abs(d.value), 0.01) for n, d in plain.derivatives.items()}
    assert max(errors.values()) < 1e-3, errors
    for name in ("CL_alpha", "CD_0", "Cm_alpha", "Cl_p"):
        assert abs(without_tables[name].value / plain.derivatives[name].value - 1.0) > 0.03, name


@pytest.mark.parametrize("tables", [(), TABLES])
def test_one_sample_and_many_give_the_same_bits(tables: tuple[LookupTable, ...]) -> None:
    aircraft = with_derivatives(AIRCRAFT["IMU and vanes away from the CG"], CL_V=0.2, CD_k=0.05)
    aircraft = replace(aircraft, tables=tables)
    time = np.arange(0.0, 3.0, 0.01)
    samples = exact_flight(aircraft, time)
    single = [regression_signals.scalar_signals(aircraft)(sample) for sample in samples.tolist()]
    rows, angles = regression_signals.array_signals(aircraft)([np.ascontiguousarray(column) for column in samples.T])
    assert np.stack(rows, axis=1).tobytes() == np.array([row for row, _ in single]).tobytes()
    assert np.stack(angles, axis=1).tobytes() == np.array([pair for _, pair in single]).tobytes()
    gain = regression_signals.momentum_gain(aircraft)
    motion = [*samples.T[3:6], *angles]
    many = np.stack(gain([m[:-1] for m in motion], [m[1:] for m in motion]), axis=1)
    states = np.stack(motion, axis=1).tolist()
    assert many.tobytes() == np.array([gain(a, b) for a, b in pairwise(states)]).tobytes()


def test_momentum_gain_is_the_integral_of_the_momentum_matrix() -> None:
    """Rates that rise evenly at small flight angles: the matrix times the angular acceleration times the step."""
    aircraft = AIRCRAFT["IMU and vanes away from the CG"]
    acceleration, step = np.array([0.7, -0.4, 0.2]), 0.01
    X, Y, Z, L, M, N = step * acceleration @ regression_signals.momentum_matrix(aircraft)
    gain = regression_signals.momentum_gain(aircraft)((0.0, 0.0, 0.0, 0.8, 0.6), (*(step * acceleration), 0.8, 0.6))
    np.testing.assert_allclose(gain, [0.6 * X - 0.8 * Z, -0.8 * X - 0.6 * Z, Y, L, M, N], rtol=1e-12)


def test_columns_are_named() -> None:
    layout = regression_signals.layout(PLAIN, ("alpha", "p"))
    assert layout.names[:9] == ("CL", "CD", "CY", "Cl", "Cm", "Cn", "0", "1", "t")
    assert layout.names[layout.deflections] == ("de", "da", "dr")
    assert layout.names[layout.rates] == ("de rate", "da rate", "dr rate")
    assert layout.instrument("alpha") == layout.names.index("alpha instrument")
    assert layout.instrument("q") == layout.column("q")
    assert layout.width == len(layout.names) == layout.transformed + 2


@pytest.mark.parametrize(("axis", "lost"), [("Ixx", "Cl"), ("Iyy", "Cm"), ("Izz", "Cn")])
def test_an_unknown_inertia_costs_its_equation_alone(axis: str, lost: str) -> None:
    aircraft = replace(PLAIN, inertia=replace(PLAIN.inertia, **{axis: np.nan}))
    assert regression_signals.unformed(aircraft) == {lost: "inertia unknown"}
    time = np.arange(0.0, 12.0, 0.01)
    found = run(aircraft, LEAST_SQUARES, time, exact_flight(PLAIN, time), time[-1:])[0]
    for name in ("CL_alpha", "CD_alpha", "CY_beta"):
        assert found.derivatives[name].value == pytest.approx(TRUTH[name], rel=1e-3)
    unknown = found.derivatives[f"{lost}_0" if lost == "Cm" else f"{lost}_beta"]
    assert np.isnan(unknown.value)
    assert (unknown.valid, unknown.status) == (False, "inertia unknown")
    assert lost not in found.fits


def test_thrust_is_taken_as_none_where_it_is_not_measured() -> None:
    """What depends on it is said not to be known; moments do not."""
    time = np.arange(0.0, 15.0, 0.01)
    samples = exact_flight(PLAIN, time)
    samples[:, SAMPLE_COLUMNS.index("thrust")] = np.nan
    state = estimator.init(PLAIN, LEAST_SQUARES)
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    found = estimate(state).derivatives
    assert found["CD_0"].status == found["CL_0"].status == "thrust not measured"
    assert found["Cm_de"].value == pytest.approx(TRUTH["Cm_de"], rel=1e-3)
