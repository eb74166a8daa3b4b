"""What a run's report draws against time and frequency."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord


@dataclass(frozen=True)
class Spectra:
    """Amplitude spectra on one frequency axis: peak amplitude of a sinusoid at each frequency.

    ``frequency`` (F,) Hz, increasing; ``inputs`` control symbol -> (F,) in rad (thrust in N);
    ``measured`` and ``residuals`` coefficient -> (F,), non-dimensional: as measured, and measured minus modelled.
    """

    frequency: Array
    inputs: Mapping[str, Array] = field(default_factory=dict)
    measured: Mapping[str, Array] = field(default_factory=dict)
    residuals: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, values in (*self.inputs.items(), *self.measured.items(), *self.residuals.items()):
            if values.shape != self.frequency.shape:
                raise InputError(
                    f"spectrum {name!r} has {values.size} values for {self.frequency.size} frequencies; "
                    "give every spectrum on the same frequencies"
                )


@dataclass(frozen=True)
class Response:
    """A measured quantity and the model's answer to the same inputs: ``time`` (N,) s, both (N,) in ``unit``."""

    unit: str  # "" = non-dimensional
    time: Array
    measured: Array
    modelled: Array

    def __post_init__(self) -> None:
        if not self.time.shape == self.measured.shape == self.modelled.shape:
            raise InputError(
                f"response: {self.time.size} times, {self.measured.size} measured and {self.modelled.size} "
                "modelled values; the three must be equally long"
            )


@dataclass(frozen=True)
class RunSignals:
    """The recorded flight, and what the model makes of it; each part may be absent."""

    flight: FlightRecord | None = None  # the aligned samples
    spectra: Spectra | None = None
    responses: Mapping[str, Response] = field(default_factory=dict)  # by output or coefficient
    response_note: str = ""  # a sentence: how the responses were made, e.g. averaged
