"""Programs kept on disk. Truth: the same function, traced by JAX."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.sim.compiled.programs import PACKAGE, kept, prune
from sysid_node.sim.model.layout import Scalar

X = jnp.linspace(0.0, 1.0, 5)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "sysid" / "programs"


def traced(times: list[str], package: Path = PACKAGE) -> object:
    """A program that notes when it is traced."""

    @kept(1, package)
    def powers(name: str, tree: dict[str, Scalar]) -> tuple[Scalar, Scalar]:
        times.append(name)
        return jnp.sin(tree["x"]), jax.jacfwd(lambda x: x**3)(tree["x"]).diagonal()

    return powers


def test_it_gives_what_the_function_gives_and_is_traced_once_for_all_processes(folder: Path) -> None:
    for times, wanted in (([], ["once"]), ([], [])):  # another closure: as another process
        sine, slope = traced(times)("once", {"x": X})
        np.testing.assert_array_equal(sine, jnp.sin(X))
        np.testing.assert_allclose(slope, 3.0 * X**2, rtol=1e-15)
        assert times == wanted
    assert len(list(folder.iterdir())) == 1


def test_it_may_be_transformed(folder: Path) -> None:
    """The function itself is used then, as nothing from the disk can be."""
    program = traced([])
    many = jnp.stack([X, 2.0 * X])
    program("many", {"x": X})
    sines, _ = jax.vmap(lambda x: program("many", {"x": x}))(many)
    np.testing.assert_allclose(sines, jnp.sin(many), rtol=1e-15)
    slopes = jax.jacfwd(lambda x: program("many", {"x": x})[0])(X)
    np.testing.assert_allclose(slopes.diagonal(), jnp.cos(X), rtol=1e-15)


def test_other_fixed_arguments_shapes_or_sources_are_other_programs(folder: Path, tmp_path: Path) -> None:
    times: list[str] = []
    program = traced(times)
    program("one", {"x": X})
    program("two", {"x": X})
    program("one", {"x": X[:3]})
    other = tmp_path / "other" / "sim"
    other.mkdir(parents=True)
    (other / "chain.py").write_text("# another version of the simulator")
    traced(times, other.parent)("one", {"x": X})
    assert times == ["one", "two", "one", "one"]
    assert len(list(folder.iterdir())) == 4


@pytest.mark.parametrize("content", [b"", b"half of one"])
def test_a_file_that_cannot_be_read_is_written_anew(folder: Path, content: bytes) -> None:
    traced([])("once", {"x": X})
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(content)
    times: list[str] = []
    sine, _ = traced(times)("once", {"x": X})
    np.testing.assert_array_equal(sine, jnp.sin(X))
    assert times == ["once"]
    assert len(path.read_bytes()) == len(whole)


def test_without_a_folder_to_write_or_flatbuffers_it_is_traced(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.parent.write_text("a file where the folder would be")
    np.testing.assert_array_equal(traced([])("once", {"x": X})[0], jnp.sin(X))
    monkeypatch.setitem(sys.modules, "flatbuffers", None)  # as where it is not installed
    np.testing.assert_array_equal(traced([])("once", {"x": X})[0], jnp.sin(X))


def test_programs_used_longest_ago_are_deleted_beyond_the_largest_size(tmp_path: Path) -> None:
    for age, name in enumerate(("newest", "middle", "oldest")):
        path = tmp_path / name
        path.write_bytes(bytes(100))
        os.utime(path, (1000.0 - age, 1000.0 - age))
    prune(tmp_path, 250)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["middle", "newest"]
    prune(tmp_path, 250)
    assert len(list(tmp_path.iterdir())) == 2


def test_a_program_that_is_used_becomes_the_newest(folder: Path) -> None:
    program = traced([])
    program("one", {"x": X})
    (path,) = folder.iterdir()
    os.utime(path, (1000.0, 1000.0))
    traced([])("one", {"x": X})
    assert path.stat().st_mtime > 1000.0


def squares(times: list[str], module: str, package: Path) -> object:
    """A program of a module, which notes when it is traced."""

    def square(name: str, x: Scalar) -> Scalar:
        times.append(module)
        return x**2

    square.__module__ = module
    return kept(1, package)(square)


def test_a_program_is_another_only_where_its_layer_or_one_below_has_changed(folder: Path, tmp_path: Path) -> None:
    times: list[str] = []
    for sources in (
        {"sim": "first", "gap": "first"},
        {"sim": "first", "gap": "other"},
        {"sim": "other", "gap": "other"},
    ):
        package = tmp_path / "_".join(sources.values())
        for layer, text in sources.items():
            (package / layer).mkdir(parents=True)
            (package / layer / "chain.py").write_text(f"# {text}")
        times.append(package.name)
        squares(times, "sysid_node.sim.any", package)("one", X)
    traced_now = "sysid_node.sim.any"
    assert times == ["first_first", traced_now, "first_other", "other_other", traced_now]


def test_functions_of_one_name_in_two_modules_are_two_programs(folder: Path, tmp_path: Path) -> None:
    times: list[str] = []
    for module in ("sysid_node.sim.one", "sysid_node.sim.other"):
        squares(times, module, tmp_path)("one", X)
    assert times == ["sysid_node.sim.one", "sysid_node.sim.other"]
