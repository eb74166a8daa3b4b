"""What ``sysid loop`` does during the flight: set-points, excitation, the failure, and the record of events."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sysid_node.cli.live.loop_scenario import EXCITE_AT, ONSET, LoopScenario, set_points
from sysid_node.errors import InputError
from sysid_node.excite.exciter import UNDER_WAY
from sysid_node.report.results.closed_loop import Event

if TYPE_CHECKING:
    from sysid_node.ros.support.loop_watch import LoopWatch

PAUSE = 3.0  # s from an abort of the excitation until it is requested again
START_UP = 60.0  # s in which the first command must come
PERIOD = 0.1  # s for which messages are received in each step


class LoopDirector:
    """Directs one flight step by step; ``events`` holds what happened, by time."""

    def __init__(self, scenario: LoopScenario, watch: LoopWatch) -> None:
        self.scenario = scenario
        self.watch = watch
        self.events: list[Event] = []
        self._reports: dict[str, str] = {}  # the last report of each node
        self._waited = 0.0  # s without a command
        self._excite_at = EXCITE_AT  # s; infinite while the excitation runs
        self._failed = False

    def step(self) -> None:
        """Receive messages, then act. Raises RuntimeError if no node answers, InputError on a refused failure."""
        self.watch.listen(PERIOD)
        self._require_commands()
        self.watch.ask_for(set_points(self.watch.time))
        self._excite()
        self._fail()
        self._note_reports()

    def _require_commands(self) -> None:
        if self.watch.tracking:
            return
        self._waited += PERIOD
        if self._waited > START_UP:
            logs = self.scenario.out
            raise RuntimeError(f"no command came within {START_UP:g} s; the logs in {logs} may say why")

    def _excite(self) -> None:
        """Request the excitation when it is due, and again some time after it was refused or aborted."""
        if self.watch.time >= self._excite_at:
            refused = self.watch.excite()
            self._note("loop", f"excitation refused: {refused}" if refused else "excitation asked for")
            begun = not refused or UNDER_WAY in refused
            self._excite_at = math.inf if begun else self.watch.time + PAUSE
        if self._excite_at == math.inf and self.watch.value("exciter", "last event").startswith("aborted"):
            self._excite_at = self.watch.time + PAUSE

    def _fail(self) -> None:
        """Begin the failure at its time."""
        if self._failed or not self.scenario.fail or self.watch.time < ONSET:
            return
        refused = self.watch.set_effects(self.scenario.effects_after_failure)
        if refused:
            raise InputError(f"--fail {self.scenario.fail}: {refused}")
        self._failed = True
        self._note("loop", self.scenario.fail)

    def _note_reports(self) -> None:
        """Note what the nodes report, where it differs from their last report."""
        reports = self.watch.news()
        for node, text in reports.items():
            if text and text != self._reports.get(node):
                self._note(node, text)
        self._reports |= reports

    def _note(self, node: str, text: str) -> None:
        self.events.append(Event(self.watch.time, node, text))
