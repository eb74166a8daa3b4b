"""The identifier's statuses on /diagnostics: state, input, estimate, computation."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from sysid_node.flight.live.monitor import Durations, TopicMonitor
from sysid_node.online.types import Estimates

OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE

FOREIGN_CLOCK = 60.0  # s of lag, beyond which the stamps are taken to be of another clock, as in a replay


@dataclass(frozen=True)
class Source:
    """The node that reports, and the aircraft that it identifies."""

    node: str
    aircraft: str

    def state(self, label: str, fault: str, faults: int) -> DiagnosticStatus:
        """The lifecycle state, and the last fault."""
        message = f"{label}: {fault}" if fault else label
        values = {"state": label, "last fault": fault, "exceptions in callbacks": faults}
        return self._status("state", ERROR if fault else OK, message, values)

    def input(
        self, topics: Sequence[TopicMonitor], rejected: Mapping[str, int], stale_after: float
    ) -> DiagnosticStatus:
        """Rates, silence beyond ``stale_after`` s, and rejected messages (``"<topic>: <reason>"`` -> count)."""
        values: dict[str, object] = {}
        for topic in topics:
            values[f"{topic.name}: received"] = topic.received
            values[f"{topic.name}: rate (Hz)"] = topic.rate()
            values[f"{topic.name}: silent for (s)"] = topic.silence()
        values |= {f"rejected, {reason}": count for reason, count in rejected.items()}
        faults = [f"{t.name} never received" for t in topics if not t.received]
        faults += [f"{t.name} silent for {t.silence():.1f} s" for t in topics if t.silence() > stale_after]
        if rejected:
            most = max(rejected, key=lambda reason: rejected[reason])
            faults.append(f"{sum(rejected.values())} messages rejected, most as {most}")
        silent = any(not t.received or t.silence() > stale_after for t in topics)
        level = STALE if silent else WARN if rejected else OK
        return self._status("input", level, "; ".join(faults) or "all topics arrive", values)

    def estimate(self, estimates: Estimates, samples: int) -> DiagnosticStatus:
        """How many derivatives are valid, and why the others are not."""
        by_status: defaultdict[str, list[str]] = defaultdict(list)
        for derivative in estimates.derivatives.values():
            by_status[derivative.status].append(derivative.name)
        valid = sum(derivative.valid for derivative in estimates.derivatives.values())
        values: dict[str, object] = {"flight time (s)": estimates.time, "samples": samples}
        values |= {reason: " ".join(names) for reason, names in by_status.items()}
        values |= {f"R^2 of {fit.coefficient}": fit.r_squared for fit in estimates.fits.values()}
        message = f"{valid} of {len(estimates.derivatives)} derivatives valid"
        return self._status("estimate", OK if valid else WARN, message, values)

    def computation(self, work: Mapping[str, Durations], lag: float) -> DiagnosticStatus:
        """Durations (p50, p99), and the lag (s) from a sample's stamp to the publication of its estimate."""
        values: dict[str, object] = {"lag (s)": lag}
        for kind, durations in work.items():
            p50, p99 = durations.percentiles()
            values[f"{kind} p50 (us)"] = 1e6 * p50
            values[f"{kind} p99 (us)"] = 1e6 * p99
        late = f"{1e3 * lag:.1f} ms after its sample" if abs(lag) < FOREIGN_CLOCK else "of another clock's stamps"
        return self._status("computation", OK, f"last estimate {late}", values)

    def _status(self, part: str, level: bytes, message: str, values: Mapping[str, object]) -> DiagnosticStatus:
        pairs = [
            KeyValue(key=key, value=f"{value:.6g}" if isinstance(value, float) else str(value))
            for key, value in values.items()
        ]
        return DiagnosticStatus(
            level=level, name=f"{self.node}: {part}", message=message, hardware_id=self.aircraft, values=pairs
        )
