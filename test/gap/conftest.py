"""What the tests of the gap share: flights of known effects, flown once."""

import fcntl
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.gap.diagnose import Diagnosis, diagnose
from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.sim import Simulator

Effects = Mapping[str, Mapping[str, float]]

#: Errors of derivatives within their tolerances.
WRONG_DERIVATIVES = {"Cm_alpha": 0.015, "Cm_de": 0.04, "CL_alpha": -0.2, "Cl_p": 0.03, "Cn_beta": 0.006, "Cl_da": 0.02}


@pytest.fixture(scope="session")
def aircraft() -> Aircraft:
    return load_aircraft("cdrw")


@pytest.fixture(scope="session")
def make_flight(aircraft: Aircraft) -> Callable[..., GapFlight]:
    return lambda effects, **conditions: fly(aircraft, effects, **conditions)


@pytest.fixture(scope="session")
def plain(aircraft: Aircraft) -> GapFlight:
    return fly(aircraft, {}, seed=1)


@pytest.fixture(scope="session")
def plain_model(aircraft: Aircraft, plain: GapFlight, tmp_path_factory: pytest.TempPathFactory) -> ResidualModel:
    """The residual model of the plain flight. One worker at a time compiles its programs; the next one loads them."""
    with (tmp_path_factory.getbasetemp().parent / "compiling").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return residual_model_of(Simulator(aircraft, 50.0), plain)


@pytest.fixture(scope="session")
def wrong_derivatives() -> dict[str, float]:
    return WRONG_DERIVATIVES


@pytest.fixture(scope="session")
def lagging(aircraft: Aircraft, plain_model: ResidualModel) -> Diagnosis:
    """The diagnosis of a servo's lag through wrong derivatives, checked on a flight held out.

    It takes the programs that the plain model has compiled.
    """
    effects = {"actuator_lag": {"time_constant": 0.08}, "derivative_error": WRONG_DERIVATIVES}
    return diagnose(aircraft, [fly(aircraft, effects, seed=5)], [fly(aircraft, effects, seed=6)])


@pytest.fixture(scope="session")
def servos_fitted(aircraft: Aircraft, lagging: Diagnosis) -> Diagnosis:
    """A diagnosis without causes whose fit is where a flight has the file's servos and Cm_alpha, within tolerances."""
    filed = replace(aircraft, effects={"actuator_lag": {"elevator": UncertainValue(0.03, 0.01)}})
    flown = {"actuator_lag": {"elevator": 0.04}, "derivative_error": {"Cm_alpha": 0.015}}
    model = residual_model_of(Simulator(filed, 50.0), fly(filed, flown, seed=7))
    fit = unfitted([model], nuisances_of(filed, model)).at([model.simulator.vector(flown)])
    attribution = replace(lagging.attribution, corrected=fit, causes=())
    file, fitted = (
        Evidence(np.zeros(1), (FlightEvidence.throughout(model, point),))
        for point in (model.simulator.neutral(), fit.flights[0].point)
    )
    check = replace(lagging.check, base=file, final=fitted, explanation=attribution)
    return replace(lagging, aircraft=filed, attribution=attribution, check=check)


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(3)
