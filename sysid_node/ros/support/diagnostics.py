"""The identifier's statuses on /diagnostics: state, input, estimate, computation."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from sysid_node.flight.checks import CLOCK_STEP, DUPLICATE, OUT_OF_ORDER, UNSTAMPED, gap
from sysid_node.flight.live.monitor import Durations, TopicMonitor
from sysid_node.flight.live.recent_counts import ALL, RecentTopic
from sysid_node.online.types import Estimates

OK, WARN, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE

LATE, TOO_LATE = 0.5, 2.0  # s of lag, from which estimates are late, and too late to fly by
FOREIGN_CLOCK = 60.0  # s of lag, beyond which the stamps are taken to be of another clock, as in a replay


@dataclass(frozen=True)
class DiagnosticSource:
    """The node that reports, and the aircraft that it identifies."""

    node: str
    aircraft: str

    def state(self, label: str, fault: str, faults: int) -> DiagnosticStatus:
        """The lifecycle state, and the last fault."""
        message = f"{label}: {fault}" if fault else label
        values = {"state": label, "last fault": fault, "exceptions in callbacks": faults}
        return self._status("state", ERROR if fault else OK, message, values)

    def input(
        self,
        topics: Sequence[TopicMonitor],
        rejected: Mapping[str, int],
        stale_after: float,
        recent: Sequence[RecentTopic] = (),
        wrong_readings: Sequence[str] = (),
        max_gap: float = 0.0,
        doubt: str = "",
    ) -> DiagnosticStatus:
        """Rates, silence beyond ``stale_after`` s, and rejected messages (``"<topic>: <reason>"`` -> count).

        ``wrong_readings``: what is wrong with the mean specific force and other readings, in words.
        ``max_gap``: see ``rejections``. ``doubt``: what may be wrong, which is a warning.

        The level is that of the ``recent`` messages: ERROR where as good as all of a topic are rejected, WARN where
        more than a few are.
        """
        values: dict[str, object] = {}
        for topic in topics:
            values |= {f"{topic.name}: topic": topic.resolved} if topic.resolved else {}
            values[f"{topic.name}: received"] = topic.received
            values[f"{topic.name}: rate (Hz)"] = topic.rate()
            values[f"{topic.name}: silent for (s)"] = topic.silence()
        values |= {f"rejected, {reason}": count for reason, count in rejected.items()}
        silent = [t for t in topics if not t.received or t.silence() > stale_after]
        faults = [
            f"{t.resolved or t.name} {f'silent for {t.silence():.1f} s' if t.received else 'never received'}"
            for t in silent
        ]
        wrong = rejections(recent, {t.name: t.resolved for t in topics if t.resolved}, max_gap)
        faults += [f"{name}: {text}" for name, text in wrong.items()]
        unlikely = [words for words in wrong_readings if words]
        faults += [*unlikely, *filter(None, [doubt])]
        worst = max((topic.share for topic in recent if topic.troubled), default=0.0)
        level = STALE if silent else ERROR if worst >= ALL or unlikely else WARN if worst or doubt else OK
        return self._status("input", level, "; ".join(faults) or "all topics arrive", values)

    def waits(self, part: str) -> DiagnosticStatus:
        """The status of ``estimate`` or ``computation`` before the first estimate."""
        return self._status(part, WARN, "no estimate yet: no sample with all inputs has come", {})

    def estimate(self, estimates: Estimates, samples: int, lag: float = 0.0, actuators: str = "") -> DiagnosticStatus:
        """How many derivatives are valid, why the others are not, and whether they come too late (``lag``, s).

        ``actuators``: what their messages are taken for.
        """
        by_status: defaultdict[str, list[str]] = defaultdict(list)
        for derivative in estimates.derivatives.values():
            by_status[derivative.status].append(derivative.name)
        valid = sum(derivative.valid for derivative in estimates.derivatives.values())
        values: dict[str, object] = {"flight time (s)": estimates.time, "samples": samples}
        values |= {"actuators carry": actuators} if actuators else {}
        values |= {reason: " ".join(names) for reason, names in by_status.items()}
        values |= {f"R^2 of {fit.coefficient}": fit.r_squared for fit in estimates.fits.values()}
        message = f"{valid} of {len(estimates.derivatives)} derivatives valid"
        late = lag_level(lag)
        message += f", {lag_words(lag)}" if late != OK else ""
        return self._status("estimate", max(late, OK if valid else WARN), message, values)

    def computation(self, work: Mapping[str, Durations], lag: float, silence: float = 0.0) -> DiagnosticStatus:
        """Durations (p50, p99), and the lag (s) from a sample's stamp to the publication of its estimate.

        ``silence``: s since the last sample where that is too long ago, else 0.
        """
        values: dict[str, object] = {"lag (s)": lag}
        for kind, durations in work.items():
            p50, p99 = durations.percentiles()
            values[f"{kind} p50 (us)"] = 1e6 * p50
            values[f"{kind} p99 (us)"] = 1e6 * p99
        message = f"no sample for {silence:.1f} s; before, " if silence else ""
        message += f"last estimate {lag_words(lag)}"
        return self._status("computation", max(lag_level(lag), WARN if silence else OK), message, values)

    def _status(self, part: str, level: bytes, message: str, values: Mapping[str, object]) -> DiagnosticStatus:
        pairs = [
            KeyValue(key=key, value=f"{value:.6g}" if isinstance(value, float) else str(value))
            for key, value in values.items()
        ]
        return DiagnosticStatus(
            level=level, name=f"{self.node}: {part}", message=message, hardware_id=self.aircraft, values=pairs
        )


def lag_level(lag: float) -> bytes:
    """The level of a lag (s): stamps of another clock, as in a replay, have none."""
    level: bytes = OK
    if abs(lag) < FOREIGN_CLOCK:
        level = ERROR if lag > TOO_LATE else WARN if abs(lag) > LATE else OK
    return level


def lag_words(lag: float) -> str:
    """How late (s) an estimate was published, in words."""
    if not abs(lag) < FOREIGN_CLOCK:
        return "with stamps of another clock, by which its delay is not known"
    return f"{1e3 * lag:.1f} ms after its sample" if lag > -LATE else f"{-lag:.1f} s before the stamp of its sample"


#: What to do about messages that are left out for their stamps.
_REMEDIES = {
    CLOCK_STEP: "was the clock set, or did a recording begin anew? The record goes on after a break",
    UNSTAMPED: "have the driver put the time of measurement into the header",
    DUPLICATE: "does the topic have two publishers, or a driver that repeats messages?",
    OUT_OF_ORDER: "does the topic have two publishers, with clocks that differ?",
}


def rejections(
    recent: Sequence[RecentTopic], resolved: Mapping[str, str], max_gap: float = 0.0, parameter: str = " (max_gap)"
) -> dict[str, str]:
    """What was rejected of each topic lately, by its resolved name, and what to do where that is for gaps in another.

    ``max_gap`` (s) is the longest gap that is interpolated across; 0 where nothing is. ``parameter`` names the
    parameter that sets it; it is empty where none does.
    """
    words = {}
    for topic in recent:
        if topic.rejected:
            count = sum(topic.rejected.values())
            words[resolved.get(topic.topic, topic.topic)] = (
                f"{'all' if topic.share >= ALL else count} of {topic.received} messages rejected, most as {topic.most}"
                + _remedy(topic.most, resolved, max_gap, parameter)
            )
    return words


def _remedy(reason: str, resolved: Mapping[str, str], max_gap: float, parameter: str) -> str:
    """What to do about messages that are left out for gaps in another topic, or for their stamps; else empty."""
    if reason in _REMEDIES:
        return f": {_REMEDIES[reason]}"
    other = next((name for topic, name in resolved.items() if reason == gap(topic)), "")
    if not other or not max_gap:
        return ""
    return f": {other} must come at least every {max_gap:g} s{parameter}, stamped by the same clock"
