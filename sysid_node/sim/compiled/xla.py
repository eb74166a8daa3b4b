"""How XLA compiles the simulator: float64, one kernel per time loop, compiled programs kept on disk.

A flight is a long loop over a short step of scalar arithmetic. By default XLA:CPU dispatches each of the loop's
hundred-odd fused operations separately. With a threshold below which the loop counts as "small", it compiles the whole
loop into one kernel, which runs about twenty times faster. The options must be in the environment before JAX compiles
anything: a program that has used JAX before it imports this package keeps its own options, and only the speed differs.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import jax

_OPTIONS = {
    "--xla_cpu_enable_concurrency_optimized_scheduler": "false",
    "--xla_backend_extra_options": (
        "xla_cpu_small_while_loop_byte_threshold=2000000000,xla_cpu_use_multi_output_fusion=true"
    ),
}

#: Releases that have these options: any other would end the process at the first compilation.
_KNOWS = "0.10."

#: Environment variable that leaves the options out where it is 1, so that a bench can measure their effect.
PLAIN_VARIABLE = "SYSID_XLA_PLAIN"


def configure() -> None:
    """Set float64 and, where the user has not set them, the compiler's options and the persistent cache.

    Warns where this release of JAX is not known to have the options: results are the same, flights take longer.
    """
    if not jax.__version__.startswith(_KNOWS):
        message = (
            f"JAX {jax.__version__}: the compiler's options for time loops are known for {_KNOWS}x alone and are left "
            "out; simulated flights give the same results but may take about twenty times as long"
        )
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    elif os.environ.get(PLAIN_VARIABLE, "") != "1":
        flags = os.environ.get("XLA_FLAGS", "")
        missing = [f"{option}={value}" for option, value in _OPTIONS.items() if option not in flags]
        os.environ["XLA_FLAGS"] = " ".join([flags, *missing]).strip()
    _set("jax_enable_x64", True)
    if jax.config.jax_compilation_cache_dir is None:  # type: ignore[attr-defined]
        _set("jax_compilation_cache_dir", str(cache_folder("xla")))
        _set("jax_persistent_cache_min_compile_time_secs", 0.0)  # dozens of small programs together take half a second


def _set(option: str, value: object) -> None:
    jax.config.update(option, value)  # type: ignore[no-untyped-call]


def cache_folder(name: str) -> Path:
    """The folder ``$XDG_CACHE_HOME/sysid/<name>``, by default under ``~/.cache``."""
    root = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(root) if root else Path.home() / ".cache") / "sysid" / name
