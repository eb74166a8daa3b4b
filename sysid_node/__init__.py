"""sysid: aerodynamic identification of fixed-wing aircraft, in flight and at the desk.

``from sysid_node import load, replay, identify, diagnose`` is the Python interface (``sysid_node.api``).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sysid_node.api import diagnose, identify, load, replay

__version__ = "0.1.0"
__all__ = ["diagnose", "identify", "load", "replay"]


def __getattr__(name: str) -> Any:
    """The functions of ``sysid_node.api``, imported when they are first asked for."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from sysid_node import api  # noqa: PLC0415  # `import sysid_node` alone stays quick

    return getattr(api, name)
