"""Flights cut where the recording was interrupted."""

import dataclasses

import numpy as np
import pytest
from made_flight import clean

from sysid_node.batch.models.stretches import interruptions_in_words, stretches

CONTROLS = ("de", "da", "dr", "thrust")


def changed(record, **columns):
    return dataclasses.replace(record, columns={**record.columns, **columns})


def without(record, begin, end):
    """The record without what was recorded between these times, s."""
    kept = ~((record.time > begin) & (record.time < end))
    columns = {name: values[kept] for name, values in record.columns.items()}
    return dataclasses.replace(record, time=record.time[kept], columns=columns)


def test_a_flight_without_interruptions_stays_as_it_is():
    record = clean()
    assert stretches(record, CONTROLS, 0.2) == ([record], [])
    missing = without(record, 3.0, 3.15)  # shorter than what counts as an interruption
    assert stretches(missing, CONTROLS, 0.2) == ([missing], [])
    slow = clean(60.0, rate=10.0)  # Hz
    assert stretches(without(slow, 3.05, 3.35), CONTROLS, 0.2)[1] == []  # four usual steps


def test_a_flight_is_cut_at_an_interruption_and_this_is_said():
    record = clean()
    parts, remarks = stretches(without(record, 4.0, 6.0), CONTROLS, 0.2)
    assert [part.name for part in parts] == ["kestrel +1 [1/2]", "kestrel +1 [2/2]"]
    assert [part.time[0] for part in parts] == [0.0, 0.0]
    np.testing.assert_array_equal(parts[1]["q"], record["q"][record.time >= 6.0])
    assert parts[1].start_ns == pytest.approx(record.start_ns + 6e9)
    said = "the recording is interrupted once, for 2 of 12 s in all"
    assert remarks == [f"kestrel +1: {said}; 2 stretches of 9.99 s together are used"]
    assert interruptions_in_words(without(record, 4.0, 6.0), 0.2) == f"kestrel +1: {said}"
    assert interruptions_in_words(record, 0.2) == ""


def test_stretches_that_are_short_or_lack_a_signal_are_left_out():
    record = clean()
    parts, remarks = stretches(without(record, 1.0, 2.0), CONTROLS, 0.2)
    assert [part.name for part in parts] == ["kestrel +1"]
    assert remarks[0].endswith("; 9.99 s are used")
    blind = changed(record, alpha=np.where(record.time < 4.5, np.nan, record["alpha"]))
    assert len(stretches(without(blind, 4.0, 6.0), CONTROLS, 0.2)[0]) == 1
    parked = changed(record, V=np.where(record.time < 4.5, 0.5, record["V"]))
    assert len(stretches(without(parked, 4.0, 6.0), CONTROLS, 0.2)[0]) == 1
    everywhere = without(record, 1.9, 10.5)
    assert stretches(everywhere, CONTROLS, 0.2)[0] == [everywhere]  # no stretch is left: the methods say what is wrong


def test_samples_that_lack_an_input_are_left_out_unless_they_are_most():
    record = clean()
    hole = (record.time > 4.0) & (record.time < 6.0)
    parts, remarks = stretches(changed(record, de=np.where(hole, np.nan, record["de"])), CONTROLS, 0.2)
    assert len(parts) == 2
    assert all(np.isfinite(part["de"]).all() for part in parts)
    assert remarks[0] == "kestrel +1: 199 of 1200 samples lack a value of de, and were left out"
    moment = changed(record, da=np.where(np.abs(record.time - 5.0) < 0.035, np.nan, record["da"]))
    ((part,), _) = stretches(moment, CONTROLS, 0.2)
    assert len(part) == len(record) - 7
    most = changed(record, de=np.where(record.time < 7.0, np.nan, record["de"]))
    assert stretches(most, CONTROLS, 0.2) == ([most], [])
    never = changed(record, thrust=np.full(len(record), np.nan))
    assert stretches(never, CONTROLS, 0.2) == ([never], [])
