"""Layer ``api``: what a notebook and the commands of ``sysid`` call, from a flight's file to a result.

``load`` names a flight and its aircraft; ``replay``, ``identify`` and ``diagnose`` turn flights into results, which
print, plot and save themselves. Each function is imported when it is first asked for, so that ``import sysid_node``
stays quick; ``from sysid_node import load, replay, identify, diagnose`` gives the same functions.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sysid_node.api.flight_file import FlightFile, load
    from sysid_node.api.gap_diagnosis import GapDiagnosis, diagnose
    from sysid_node.api.identification import BatchIdentification, identify
    from sysid_node.api.replaying import Replay, replay

__all__ = ["BatchIdentification", "FlightFile", "GapDiagnosis", "Replay", "diagnose", "identify", "load", "replay"]

_MODULES = {
    **dict.fromkeys(("load", "FlightFile"), "flight_file"),
    **dict.fromkeys(("replay", "Replay"), "replaying"),
    **dict.fromkeys(("identify", "BatchIdentification"), "identification"),
    **dict.fromkeys(("diagnose", "GapDiagnosis"), "gap_diagnosis"),
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
