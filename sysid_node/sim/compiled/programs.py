"""Traced programs kept on disk.

XLA's own cache holds compiled programs, but every process would still trace them, which takes seconds. A program is
kept under a digest of the sources that shape it, JAX's release, its fixed arguments and the shapes of the others.
Without the ``flatbuffers`` package, with which JAX writes programs, every process traces them.
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
_Tuple = TypeVar("_Tuple", bound=type)


def result_type(named_tuple: _Tuple) -> _Tuple:
    """The class of named tuples itself, which may then be part of the result of a program that is kept."""
    export.register_namedtuple_serialization(named_tuple, serialized_name=f"sysid.{named_tuple.__name__}")
    return named_tuple


result_type(Vector)

#: The package whose sources shape the programs.
PACKAGE = Path(__file__).parents[2]


def kept(fixed: int, package: Path = PACKAGE) -> Callable[[Callable[..., _Result]], Callable[..., _Result]]:
    """A decorator that keeps a compiled program for each value of the first ``fixed`` arguments.

    These arguments must be hashable and have the same text in every process (functions count by their names). The other
    arguments and the result are trees of arrays; a named tuple in the result must be a ``result_type``. A program on
    the disk cannot be transformed, so that the function itself is used under ``jax.vmap`` and the like. The digest is
    of the sources of the function's layer below ``package``, and of the layers that it may import.
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
            key = (function.__module__, function.__qualname__, *map(_text_of, arguments[:fixed]), tree, shapes)
            sources = _sources(package, function.__module__)
            found: Any = _program(repr(key), sources, partial(export.export(jax.jit(flat)), *shapes))
            result: _Result = found.call(*leaves)
            return result

        places = tuple(range(fixed))
        compiled, plain = jax.jit(program, static_argnums=places), jax.jit(function, static_argnums=places)

        @wraps(function)
        def chosen(*arguments: Any) -> _Result:
            transformed = any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(arguments[fixed:]))
            result: _Result = (plain if transformed else compiled)(*arguments)
            return result

        return chosen

    return decorated


def _text_of(value: Any) -> str:
    """The text of a fixed argument, the same in every process."""
    return str(value.__qualname__) if callable(value) and hasattr(value, "__qualname__") else repr(value)


def _program(key: str, sources: str, trace: Callable[[], export.Exported]) -> export.Exported:
    """The program of a key from the disk; where it cannot be read, it is traced and written there."""
    name = hashlib.sha256(f"{jax.__version__} {sources} {key}".encode()).hexdigest()
    path = cache_folder("programs") / name
    try:
        program = export.deserialize(bytearray(path.read_bytes()))
        path.touch()  # marks it as used, so that ``prune`` deletes others first
        return program
    except Exception:  # no file, an incomplete one, or one of another release
        traced = trace()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(f".{os.getpid()}-{threading.get_ident()}")
        temporary.write_bytes(traced.serialize())
        temporary.replace(path)
        prune(path.parent)
    except OSError:
        pass  # without a writable cache every process traces
    return traced


#: Layers whose sources shape the programs, the lowest first. The thresholds of the diagnosis may be constants in them.
_SHAPING = ("aircraft", "dynamics", "flight", "sim", "excite", "gap")

#: Largest size of all programs that stay on the disk, bytes.
LARGEST = 200_000_000


@cache
def _sources(package: Path, module: str) -> str:
    """Digest of the sources that shape a program: those of its module's layer and of the layers below."""
    layer = next((layer for layer in _SHAPING if f".{layer}." in module), _SHAPING[-1])
    layers = _SHAPING[: _SHAPING.index(layer) + 1]
    digest = hashlib.sha256()
    for path in sorted(path for room in layers for path in (package / room).rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode() + path.read_bytes())
    return digest.hexdigest()


def prune(folder: Path, largest: int = LARGEST) -> None:
    """Delete the programs that were used longest ago until all are no larger than ``largest`` bytes together.

    Programs of older sources are never used again, and are therefore deleted first.
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
