"""``python -m sysid_node.cli`` is ``sysid``; a signal ends it in one line from its first instruction on."""

import os
import signal
import sys
from importlib import import_module


def _end(number: int, _: object) -> None:
    os.write(2, b"sysid: interrupted\n" if number == signal.SIGINT else b"sysid: terminated\n")
    os._exit(128 + number)


for _number in (signal.SIGINT, signal.SIGTERM):
    if signal.getsignal(_number) is not signal.SIG_IGN:
        signal.signal(_number, _end)

sys.exit(import_module("sysid_node.cli.main").main())
