"""Writes a folder's report again, whichever command made the folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sysid_node.errors import InputError
from sysid_node.report.files.loop_folder import read_loop
from sysid_node.report.files.runs.run_folder import REPORT, rebuild_report
from sysid_node.report.pages.closed_loop_page import write_loop

#: Why the page of a folder cannot be made from its files alone, by the command.
_NEEDS_THE_WORK = {
    "gap": "its report shows more than its files hold, so sysid gap alone writes it; run sysid gap again",
    "aircraft": "its report shows more than its files hold, so sysid aircraft alone writes it; run it again",
    "excite": "its report shows more than its files hold, so sysid excite alone writes it; run sysid excite again",
    "fleet": "sysid fleet alone writes its report; run sysid fleet again: it does only what is missing or has changed",
}


def rewrite_report(folder: Path) -> Path:
    """The path of ``report.html``, drawn again from the folder's other files.

    Raises InputError where the folder is of no command, is damaged, or is of one whose files do not hold the page.
    """
    command, content = _command_of(folder)
    if command in _NEEDS_THE_WORK:
        raise InputError(f"{folder}: {_NEEDS_THE_WORK[command]}")
    if command != "loop":
        return rebuild_report(folder)
    try:
        write_loop(folder, read_loop(folder, content))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another folder") from None
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(f"{folder}: its files are damaged ({error}); fly again") from error
    return folder / REPORT


def _command_of(folder: Path) -> tuple[str, dict[str, Any]]:
    """The command that wrote a folder, and the content of its ``summary.json``; ``""`` where neither is known."""
    if (folder / "aircraft.json").is_file():
        return "aircraft", {}
    if (folder / "gap.json").is_file():
        return "gap", {}
    if (folder / "fleet.json").is_file():
        return "fleet", {}
    try:
        content = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return "", {}  # the reader of runs says what is wrong
    if not isinstance(content, dict):
        return "", {}
    return ("loop" if "tracking_error" in content else "excite" if "manoeuvre" in content else "run"), content
