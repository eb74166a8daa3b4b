"""Compiled programs of a process that asks for many results, as a notebook does.

JAX keeps every program that it has compiled, each of them in several memory maps. Linux allows a process only so many
maps (``vm.max_map_count``, mostly 65,530). After some ten diagnoses of different aircraft, or of flights of different
lengths, the compiler found no memory any more and ended the process.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

_MOST = Path("/proc/sys/vm/max_map_count")
_MAPS = Path("/proc/self/maps")

#: Share of the maps beyond which programs are given up: one diagnosis takes an eighth at most.
_SHARE = 0.5


def release_compiled_programs(share: float = _SHARE) -> bool:
    """Give up all compiled programs where the process has more than this ``share`` of the memory maps it may have.

    Returns whether it did. What is needed again is compiled anew, or loaded from the disk. Nothing happens on systems
    that do not say how many maps there are.
    """
    jax = sys.modules.get("jax")
    if jax is None:
        return False
    with suppress(OSError, ValueError):
        most = int(_MOST.read_text())
        with _MAPS.open("rb") as maps:
            used = sum(1 for _ in maps)
        if used > share * most:
            jax.clear_caches()
            return True
    return False
