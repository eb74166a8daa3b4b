"""Programs kept as JAX traced them: a process would trace anew, for seconds, what it then finds compiled.

A program is kept under a digest of the sources that shape it, JAX's release, and what it was traced for; where any of
these differs it is another program. Without the ``flatbuffers`` package, by which JAX writes programs, all are traced.
"""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from functools import cache, partial, wraps
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import jax
from jax import export

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.compiled.xla import cache_folder

_Result = TypeVar("_Result")

export.register_namedtuple_serialization(Vector, serialized_name="sysid.Vector")


#: The package, whose sources shape the programs.
PACKAGE = Path(__file__).parents[2]


def kept(fixed: int, package: Path = PACKAGE) -> Callable[[Callable[..., _Result]], Callable[..., _Result]]:
    """Decorator: a compiled program for each value of the first ``fixed`` arguments, traced once and for all.

    These arguments must be hashable and look the same in every process (functions go by their names); the others and
    the result are trees of arrays, the result's of tuples that ``jax.export`` knows. Programs cannot be differentiated
    further. Programs are kept apart by the sources below ``package``.
    """

    def decorated(function: Callable[..., _Result]) -> Callable[..., _Result]:
        @wraps(function)
        def program(*arguments: Any) -> _Result:
            leaves, tree = jax.tree.flatten(arguments[fixed:])
            shapes = [jax.ShapeDtypeStruct(x.shape, x.dtype) for x in leaves]  # type: ignore[no-untyped-call]

            def flat(*moving: Any) -> _Result:
                return function(*arguments[:fixed], *jax.tree.unflatten(tree, moving))

            if find_spec("flatbuffers") is None:
                return flat(*leaves)
            what = (function.__qualname__, *map(_said, arguments[:fixed]), tree, shapes)
            found: Any = _program(repr(what), _sources(package), partial(export.export(jax.jit(flat)), *shapes))
            result: _Result = found.call(*leaves)
            return result

        compiled: Callable[..., _Result] = jax.jit(program, static_argnums=tuple(range(fixed)))
        return compiled

    return decorated


def _said(value: Any) -> str:
    """A fixed argument as it looks in every process."""
    return str(value.__qualname__) if callable(value) and hasattr(value, "__qualname__") else repr(value)


def _program(what: str, sources: str, traced: Callable[[], export.Exported]) -> export.Exported:
    """The program from the disk; traced, and written there, where it is not or cannot be read."""
    name = hashlib.sha256(f"{jax.__version__} {sources} {what}".encode()).hexdigest()
    path = cache_folder("programs") / name
    try:
        program = export.deserialize(bytearray(path.read_bytes()))
        path.touch()  # used now: ``prune`` deletes others first
        return program
    except Exception:  # whatever is there: another release's, half of one, none
        found = traced()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        own = path.with_suffix(f".{os.getpid()}-{threading.get_ident()}")
        own.write_bytes(found.serialize())
        own.replace(path)
        prune(path.parent)
    except OSError:
        pass  # a cache that cannot be written is none
    return found


#: Layers whose sources shape the programs: the diagnosis with its thresholds, and what it computes with.
_SHAPING = ("aircraft", "dynamics", "flight", "sim", "gap")

#: Largest size of all programs that stay on the disk, bytes.
LARGEST = 200_000_000


@cache
def _sources(package: Path) -> str:
    """Digest of the sources that shape the programs."""
    digest = hashlib.sha256()
    for path in sorted(path for room in _SHAPING for path in (package / room).rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode() + path.read_bytes())
    return digest.hexdigest()


def prune(folder: Path, largest: int = LARGEST) -> None:
    """Delete the programs that were used longest ago until all are no larger than ``largest`` bytes together.

    Programs of older sources are never used again, and so go first.
    """
    found = []
    for path in folder.glob("*"):
        try:
            state = path.stat()
        except OSError:
            continue  # another process has deleted it
        found.append((state.st_mtime_ns, state.st_size, path))
    total = sum(size for _, size, _ in found)
    for _, size, path in sorted(found):
        if total <= largest:
            return
        path.unlink(missing_ok=True)
        total -= size
