"""What a report keeps of the aligned samples of a flight: all of a short one, a bounded number of a long one."""

from __future__ import annotations

from collections import deque

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.types import SAMPLE_COLUMNS
from sysid_node.report.drawing.thinning import extreme_rows

ATTITUDE = ("phi", "theta", "psi")
MOST = 150_000  # samples that are kept whole: twelve minutes at 200 Hz
BUCKETS = 300  # parts of a longer flight, of which those samples are kept that hold the columns' extremes
AIR_INTERVAL = SAMPLE_COLUMNS.index("air_interval")


class RecordedSamples:
    """The samples of a flight as they come.

    ``expected``: how many there will be at most. Of more than ``MOST``, the flight against time is thinned so that no
    peak is lost, and spectra and responses are those of the last ones.
    """

    def __init__(self, aircraft: Aircraft, expected: int) -> None:
        self._names = (*SAMPLE_COLUMNS, *aircraft.control_symbols)
        self._bucket = 1 if expected <= MOST else -(-expected // BUCKETS)
        self._waiting: list[Array] = []  # rows that do not fill a bucket yet
        self._kept: list[Array] = []  # time, samples, attitude
        self._last: deque[Array] = deque()
        self._start = self._end = 0.0
        self.count = 0  # samples so far

    @classmethod
    def of(cls, aircraft: Aircraft, time: Array, samples: Array) -> RecordedSamples:
        """Those of a flight at ``time`` (N,) s; ``samples`` as of ``add``."""
        found = cls(aircraft, time.size)
        found.add(time, samples, np.full((time.size, len(ATTITUDE)), np.nan))
        return found

    def add(self, time: Array, samples: Array, attitude: Array) -> None:
        """Add samples (N, M) at ``time`` (N,) s, and the attitude (N, 3) rad, of which NaN is not known.

        Columns are ``SAMPLE_COLUMNS``, then the controls in the aircraft's order; more are left out.
        """
        if not time.size:
            return
        rows = np.column_stack([time, samples[:, : len(self._names)], attitude])
        if not self.count:
            self._start = float(time[0])
        self._end, self.count = float(time[-1]), self.count + time.size
        self._last.append(rows)
        while sum(map(len, self._last)) - len(self._last[0]) >= MOST:
            self._last.popleft()
        self._keep(rows)

    def _keep(self, rows: Array) -> None:
        if self._bucket == 1:
            return  # the last ones are all
        self._waiting.append(rows)
        if sum(map(len, self._waiting)) < self._bucket:
            return
        every = np.concatenate(self._waiting)
        whole = len(every) // self._bucket * self._bucket
        self._waiting = [every[whole:]]
        self._kept += [part[extreme_rows(part[:, 1:])] for part in np.split(every[:whole], whole // self._bucket)]

    @property
    def seconds(self) -> float:
        """From the first to the last sample."""
        return self._end - self._start

    @property
    def last(self) -> tuple[Array, Array]:
        """Times (N,) s and samples (N, M): all, or at least the last ``MOST``."""
        rows = np.concatenate(self._last) if self._last else np.empty((0, 1 + len(self._names)))
        return rows[:, 0], rows[:, 1 : 1 + len(self._names)]

    @property
    def remarks(self) -> list[str]:
        """Where spectra and responses are not of the whole flight, from when on they are."""
        time, _ = self.last
        if time.size == self.count:
            return []
        return [f"Spectra and responses are those of the flight's last {(time[-1] - time[0]) / 60.0:.0f} minutes."]

    @property
    def flight(self) -> FlightRecord | None:
        """The samples against time, with the attitude where it is known; None for fewer than two."""
        if self.count < 2:
            return None
        rows = np.concatenate(self._last if self._bucket == 1 else [*self._kept, *self._waiting])
        columns = {n: rows[:, 1 + i] for i, n in enumerate(self._names) if i != AIR_INTERVAL}
        attitude = rows[:, 1 + len(self._names) :]
        if np.isfinite(attitude).any():
            columns |= dict(zip(ATTITUDE, attitude.T, strict=True))
        return FlightRecord(rows[:, 0], columns)
