"""The short-period model against the rigid body in the same motion."""

import dataclasses

import numpy as np
from made_flight import KESTREL, clean

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.manoeuvres import manoeuvre_data, with_forces_at_cg
from sysid_node.batch.models.short_period import short_period
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.flight.record import FlightRecord


def test_it_follows_the_rigid_bodys_motion_with_the_coefficients_of_that_flight():
    """CZ and Cm regressed on the very model are exact but for the curvature of CZ, small in this manoeuvre."""
    at_cg = dataclasses.replace(KESTREL, sensors=type(KESTREL.sensors)())
    record = with_forces_at_cg(KESTREL, clean())
    columns = {**record.columns, "q_measured": record["q"]}
    columns |= {axis: record[f"{axis}_cg"] for axis in ("ax", "ay", "az")}
    record = FlightRecord(record.time, columns, "at the CG")
    found = measured_coefficients(at_cg, record)
    alpha0, de0 = float(record["alpha"][0]), float(record["de"][0])
    alpha, de = found.regressors["alpha"] - alpha0, found.regressors["de"] - de0
    one = np.ones_like(alpha)
    CZ = np.linalg.lstsq(np.column_stack([alpha, de, one]), found.coefficients["CZ"], rcond=None)[0]
    Cm = np.linalg.lstsq(
        np.column_stack([alpha, found.regressors["q"], de, one]), found.coefficients["Cm"], rcond=None
    )[0]
    names = ("CZ_alpha", "CZ_de", "CZ_0", "Cm_alpha", "Cm_q", "Cm_de", "Cm_0")
    model = short_period(at_cg, dict(zip(names, (*CZ, *Cm), strict=True)), alpha0, de0)
    first = FlightRecord(record.time[:300], {n: v[:300] for n, v in record.columns.items()}, "elevator alone")
    outputs = rollout.outputs(model, manoeuvre_data(model, first), model.start)
    for column, name in enumerate(("alpha", "q", "az")):
        error = outputs[:, column] - first[name]
        assert np.sqrt(np.mean(error**2)) < 0.05 * np.ptp(first[name]), name
