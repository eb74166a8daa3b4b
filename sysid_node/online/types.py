"""What goes into and comes out of the online estimator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft

#: Columns of an aligned sample before the aerodynamic controls (which follow in the aircraft file's order).
#: Specific force at the IMU m/s^2, rates rad/s, airspeed m/s, flow angles at the air-data probe rad,
#: air density kg/m^3, thrust N (NaN = not measured), and the time between the two air-data messages that the
#: sample lies between, s: the flow angles' noise density is their variance times it. Body axes FRD.
SAMPLE_COLUMNS = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "rho", "thrust", "air_interval")
AZ = SAMPLE_COLUMNS.index("az")  # place of the specific force along z in a sample
MOTION, AIR = slice(0, 6), slice(6, 9)  # places of the IMU's readings, and of airspeed and flow angles
LIFT = tuple(SAMPLE_COLUMNS.index(name) for name in ("az", "V", "alpha", "rho"))  # places of what tells of the lift


def controls_in(aircraft: Aircraft) -> slice:
    """The places of an aircraft's controls in a sample, which may hold the same behind servos after them."""
    return slice(len(SAMPLE_COLUMNS), len(SAMPLE_COLUMNS) + len(aircraft.controls))


class DerivativeEstimate(NamedTuple):
    """One derivative with its standard error and 95 % interval; ``status`` says why it is not valid."""

    name: str
    value: float
    standard_error: float
    lower: float
    upper: float
    valid: bool
    # "ok", "converging", "not excited", "collinear with ...", "stale input", "outside model", "contradicted", "changed"
    status: str
    #: Parts of ``standard_error``: by noise and gusts, and by the tolerances of what is taken as known.
    statistical_error: float = math.nan
    systematic_error: float = 0.0


class FitQuality(NamedTuple):
    """How well one coefficient's equation is satisfied over the lines in use."""

    coefficient: str
    r_squared: float  # 0..1
    residual_std: float  # of the non-dimensional coefficient, in the band
    degrees_of_freedom: float  # independent observations beyond the parameters
    samples: int  # in the window


@dataclass(frozen=True, slots=True)
class Estimates:
    """All that the estimator knows at one time (s, of the last sample included)."""

    time: float
    derivatives: Mapping[str, DerivativeEstimate]
    fits: Mapping[str, FitQuality]
    servos: Mapping[str, DerivativeEstimate] = field(default_factory=dict)  # by control: how late it follows, s
    #: By derivative: shares of its variance by source, see ``systematic.budget``.
    budget: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
