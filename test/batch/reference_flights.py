"""Real flights set up as in the published analyses that the estimators are compared with.

Values and 1-sigma errors were obtained with the authors' own programs (Jategaonkar's FVSysID, Morelli's SIDPAC).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.batch.models.lateral_rates import lateral_rates
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.manoeuvres import manoeuvre_data, with_forces_at_cg
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.models.rigid_body import rigid_body
from sysid_node.batch.models.short_period import short_period
from sysid_node.batch.regression.filtering import differentiate, lowpass
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import Array, FlightRecord

ELEVATOR = {"elevator": Control("elevator", "de", {"elevator": 1.0})}

#: HFB-320, longitudinal: start values of Jategaonkar's test case 4.
HFB_START = {
    **{"CD_0": 5.67516e-3, "CD_V": 7.72612e-3, "CD_alpha": 6.74256e-1},
    **{"CL_0": -3.18267e-1, "CL_V": 2.60317e-1, "CL_alpha": 5.37576},
    **{"Cm_0": 4.98218e-2, "Cm_V": 1.89182e-2, "Cm_alpha": -4.98586e-1, "Cm_q": -25.8439, "Cm_de": -9.90687e-1},
}
HFB_OUTPUT_ERROR = {
    **{"CD_0": (0.1178, 0.0032), "CD_V": (-0.0517, 0.0028), "CD_alpha": (0.2349, 0.0064)},
    **{"CL_0": (-0.2047, 0.020), "CL_V": (0.3636, 0.017), "CL_alpha": (3.212, 0.039)},
    **{"Cm_0": (0.1344, 0.0051), "Cm_V": (-0.0139, 0.0047), "Cm_alpha": (-1.0024, 0.0087)},
    **{"Cm_q": (-27.06, 0.68), "Cm_de": (-1.437, 0.017)},
}
HFB_OUTPUT_ERROR_DET = 3.016e-24
HFB_FILTER_ERROR = {
    **{"CD_0": 0.1227, "CD_V": -0.0645, "CD_alpha": 0.3201, "CL_0": -0.0929, "CL_V": 0.1487, "CL_alpha": 4.328},
    **{"Cm_0": 0.1119, "Cm_V": 0.0040, "Cm_alpha": -0.968, "Cm_q": -34.71, "Cm_de": -1.529},
}
HFB_FILTER_ERROR_DET = 3.126e-31
HFB_EKF = {"CL_alpha": (4.303, 0.049), "Cm_alpha": (-0.971, 0.015), "Cm_q": (-34.94, 0.99), "Cm_de": (-1.533, 0.02)}
HFB_UKF = {"CL_alpha": 4.289, "Cm_alpha": -0.970, "Cm_q": -35.36, "Cm_de": -1.540}
#: Noise variances with which those filters were run: outputs; process noise of the states per second.
HFB_FILTER_NOISE = (
    (1.758668956825e-2, 9.9020743e-7, 1.9774013e-7, 3.3836151e-7, 3.168412236e-5, 4.1909760875e-4, 2.020310372280e-2),
    (1.2856025380900e-1, 5.86119258e-6, 2.0035203e-7, 3.01987933e-6),
)

#: ATTAS, lateral: Jategaonkar's test case 1.
ATTAS_START = dict(
    zip(
        [f"{axis}_{name}" for axis in "LNY" for name in ("p", "r", "da", "dr", "beta")],
        (
            *(-3.53744, 0.475534, -4.93279, 0.73334, -4.34076),
            *(-0.086939, -0.169526, -0.192049, -0.74855, 1.55155),
            *(0.0364, 2.130, 0.740, 2.279, -5.193),
        ),
        strict=True,
    )
)
ATTAS_OUTPUT_ERROR = {
    **{"L_p": (-2.0486, 0.0048), "L_r": (1.0786, 0.0122), "L_da": (-6.2859, 0.0116)},
    **{"L_dr": (1.1704, 0.031), "L_beta": (-3.7543, 0.020)},
    **{"N_p": (-0.1743, 0.0018), "N_r": (-0.4672, 0.0046), "N_da": (-0.3674, 0.0043)},
    **{"N_dr": (-1.6958, 0.0113), "N_beta": (2.9923, 0.0081)},
}

#: Twin Otter, flight 018: SIDPAC's demonstration of output error, errors for coloured residuals.
TWIN_OTTER_OUTPUT_ERROR = {
    **{"CZ_alpha": (-6.759, 0.081), "CZ_de": (-0.410, 0.045)},
    **{"Cm_alpha": (-1.542, 0.019), "Cm_q": (-33.23, 0.93), "Cm_de": (-1.834, 0.027)},
}
TWIN_OTTER_EQUATION_ERROR = {
    "CZ": {"alpha": (-6.349, 0.020), "q": (-18.41, 0.55), "de": (-0.626, 0.015)},
    "Cm": {"alpha": (-1.476, 0.022), "q": (-36.35, 0.69), "de": (-1.869, 0.020)},
}
TWIN_OTTER_FREQUENCY = {
    "CZ": {"alpha": (-6.347, 0.016), "q": (-18.02, 0.64), "de": (-0.613, 0.019)},
    "Cm": {"alpha": (-1.466, 0.018), "q": (-37.22, 0.71), "de": (-1.891, 0.021)},
}


@dataclass(frozen=True)
class ReferenceCase:
    """A model, a manoeuvre and the aircraft of one published analysis."""

    model: StateSpaceModel
    manoeuvre: ManoeuvreData
    aircraft: Aircraft
    record: FlightRecord


def hfb_320(
    flights: Path, outputs: tuple[str, ...] = ("V", "alpha", "theta", "q", "qdot", "ax", "az")
) -> ReferenceCase:
    """Longitudinal motion alone: what the lateral motion does is neglected, as published; constant air density."""
    mass, V0, chord = 7472.0, 104.67, 2.43
    S = 4.0280e-3 * mass
    Iyy = S * chord / 8.0027e-4
    aircraft = Aircraft(
        name="hfb320",
        source="Jategaonkar",
        mass=mass,
        inertia=Inertia(np.nan, Iyy, np.nan),
        geometry=Geometry(S, 14.5, chord),
        reference=ReferenceCondition(V0, 0.792),
        controls=ELEVATOR,
        derivatives={name: Derivative(value) for name, value in HFB_START.items()},
        throttle=Throttle("throttle", inclination=0.0524, arm=-7.0153e-6 * Iyy),
    )
    flown = read_csv(flights / "hfb320.csv")
    still = dict.fromkeys(("beta", "p", "r", "phi"), np.zeros(len(flown)))
    columns = {**flown.columns, **still, "rho": np.full(len(flown), 0.792)}
    record = with_forces_at_cg(aircraft, FlightRecord(0.1 * np.arange(len(flown)), columns, "hfb320"))
    model = rigid_body(aircraft, ("V", "alpha", "theta", "q"), outputs, reference_rates=True)
    start = {"V": 106.023, "alpha": 0.111685, "theta": 0.104887, "q": -0.00332659}
    return ReferenceCase(model, manoeuvre_data(model, record, start), aircraft, record)


def attas_lateral(flights: Path, cutoff: float = 4.0) -> ReferenceCase:
    """Roll and yaw with measured sideslip.

    The published analysis used recorded angular accelerations, which the file does not hold, and sideslip and lateral
    acceleration where they were recorded: the file has them moved (beta by 13.081 m * r / V, the acceleration by
    1.01 m * rdot and smaller terms), which is undone here. The accelerations are differentiated rates below ``cutoff``
    Hz, so that the figures can come near the published ones, and no nearer.
    """
    flown = read_csv(flights / "attas_lateral_1.csv")
    c, time = flown.columns, 0.04 * np.arange(len(flown))
    pdot, rdot = (lowpass(time, differentiate(time, c[name])[:, None], cutoff)[:, 0] for name in "pr")
    p, q, r = c["p"], c["q"], c["r"]
    columns: dict[str, Array] = {
        **c,
        "pdot": pdot,
        "rdot": rdot,
        "beta": c["beta"] + (13.081 * r + 0.026 * p) / c["V"],
        "ay": c["ay"] - (1.01 * rdot + 0.103 * pdot + 1.01 * p * q - 0.103 * q * r + 0.886 * (p**2 + r**2)),
    }
    record = FlightRecord(time, columns, "attas")
    model = lateral_rates({**ATTAS_START, **dict.fromkeys(("L_0", "N_0"), 0.02)})
    aircraft = Aircraft(
        "attas", "", 17631.0, Inertia(133367.0, 252687.0, 359593.0, 11442.0), Geometry(64.0, 21.5, 3.159),
        ReferenceCondition(130.0, 0.73), {}, {},
    )  # fmt: skip
    return ReferenceCase(model, manoeuvre_data(model, record, {"p": 0.0, "r": 0.0}), aircraft, record)


def twin_otter(flights: Path) -> ReferenceCase:
    """Short period, everything else as measured; lift, drag and pitching moment for the equation-error methods."""
    names = [f"{c}_{r}" for c in ("CL", "CD", "Cm") for r in ("0", "alpha", "q", "de")]
    aircraft = Aircraft(
        name="twin_otter",
        source="Morelli",
        mass=4944.0,
        inertia=Inertia(28353.0, 32910.0, 52168.0, 1528.0),
        geometry=Geometry(39.25, 19.81, 1.98),
        reference=ReferenceCondition(72.0, 1.029),
        controls=ELEVATOR,
        derivatives={name: Derivative(0.0) for name in names},
        throttle=Throttle("throttle"),
    )
    flown = read_csv(flights / "twin_otter_018.csv")
    columns = {**flown.columns, "q_measured": flown["q"]}
    record = FlightRecord(0.02 * np.arange(len(flown)), columns, "twin_otter_018")
    start = {"CZ_alpha": -6.3, "CZ_de": -0.6, "CZ_0": -0.6, "Cm_alpha": -1.4, "Cm_q": -36.0, "Cm_de": -1.8}
    model = short_period(aircraft, start, float(flown["alpha"][0]), float(flown["de"][0]))
    return ReferenceCase(model, manoeuvre_data(model, record), aircraft, record)
