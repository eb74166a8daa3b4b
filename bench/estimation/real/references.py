"""What the field's own programs give for the same flights: value and standard error (0: not stated).

SIDPAC (E. A. Morelli, NASA): ``rtpid``, jw[alpha, q] and CZ, Cm on alpha, q, de, f = 0.1:0.04:1.5 Hz. Programs of R. V.
Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015): ``ftr`` on jw[p, r], two repeats of the manoeuvre;
output error, filter error and extended Kalman filter on the HFB-320.
"""

from __future__ import annotations

from collections.abc import Mapping

from bench.estimation.real.dimensional import Value

Numbers = Mapping[str, Value]


def _numbers(**values: tuple[float, float]) -> Numbers:
    return {name: Value(*pair) for name, pair in values.items()}


TWIN_OTTER_RATES = _numbers(
    Z_alpha=(-1.6791, 0.0631),
    Z_q=(0.9946, 0.0347),
    Z_de=(0.0508, 0.0742),
    M_alpha=(-9.352, 0.144),
    M_q=(-3.221, 0.079),
    M_de=(-11.958, 0.169),
)
TWIN_OTTER_COEFFICIENTS = _numbers(
    CZ_alpha=(-6.347, 0.016),
    CZ_q=(-18.02, 0.64),
    CZ_de=(-0.613, 0.019),
    Cm_alpha=(-1.466, 0.018),
    Cm_q=(-37.22, 0.71),
    Cm_de=(-1.891, 0.021),
)
ATTAS = _numbers(
    L_beta=(-3.786, 0.12),
    L_p=(-2.046, 0.035),
    L_r=(1.041, 0.072),
    L_da=(-6.367, 0.078),
    L_dr=(1.277, 0.21),
    N_beta=(3.074, 0.040),
    N_p=(-0.162, 0.011),
    N_r=(-0.433, 0.024),
    N_da=(-0.352, 0.025),
    N_dr=(-1.747, 0.069),
)
HFB_OUTPUT_ERROR = _numbers(
    CL_alpha=(3.212, 0.039), Cm_alpha=(-1.0024, 0.0087), Cm_q=(-27.06, 0.68), Cm_de=(-1.437, 0.017)
)
HFB_FILTER_ERROR = _numbers(
    CL_alpha=(4.328, 0.047), Cm_alpha=(-0.968, 0.011), Cm_q=(-34.71, 0.79), Cm_de=(-1.529, 0.019)
)
HFB_EKF = _numbers(CL_alpha=(4.303, 0.049), Cm_alpha=(-0.971, 0.015), Cm_q=(-34.94, 0.99), Cm_de=(-1.533, 0.0))
