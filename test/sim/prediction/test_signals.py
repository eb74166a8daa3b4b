"""The measured signals of a flight record."""

import numpy as np
import pytest
from plain import three_axes
from simulated_signals import SAMPLES, signals_from

from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import trim_flight
from sysid_node.sim.prediction.signals import MeasuredSignals, signals_of


def test_signals_of_a_record(simulator):
    trim = trim_flight(simulator)
    inputs = simulator.inputs(trim.command + three_axes(SAMPLES, simulator.step))
    flight = simulator.rollout(simulator.neutral(), trim.initial, inputs)
    direct = signals_from(flight, inputs.commands, simulator.step)
    outputs, commands = np.asarray(flight.outputs), np.asarray(inputs.commands)
    columns = dict(zip(simulator.outputs, outputs.T, strict=True)) | {"rho": np.asarray(direct.density)}
    columns |= dict(zip(("de", "da", "dr", "thrust"), commands.T, strict=True))
    record = FlightRecord(np.arange(SAMPLES) * simulator.step, columns)
    for name, ours, theirs in zip(MeasuredSignals._fields, signals_of(simulator, record), direct, strict=True):
        # the first three come from the inertial instruments, the last from a record that was low-passed
        if name in ("velocity", "alpha_rate", "air_rotation", "unfiltered"):
            assert ours is theirs is None
            continue
        np.testing.assert_allclose(ours, theirs, atol=0.1 if name == "climb" else 1e-9, err_msg=name)
    del columns["beta"]
    with pytest.raises(InputError, match="no complete beta"):
        signals_of(simulator, FlightRecord(record.time, columns))
