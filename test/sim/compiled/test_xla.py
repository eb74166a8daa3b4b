"""The compiler's options, in fresh processes: set, left out on request, and left out with a warning."""

import os
import subprocess
import sys

CODE = """
import warnings, jax
jax.__version__ = {version!r} or jax.__version__
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import sysid_node.sim
import os
said = [str(w.message) for w in caught if "JAX" in str(w.message)]
print("small_while_loop" in os.environ.get("XLA_FLAGS", ""), said)
"""


def configured(version: str = "", **environment: str) -> str:
    known = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    done = subprocess.run(
        [sys.executable, "-c", CODE.format(version=version)],
        capture_output=True,
        text=True,
        check=True,
        env={**known, **environment},
    )
    return done.stdout


def test_the_options_are_set_without_a_word() -> None:
    assert configured() == "True []\n"


def test_they_can_be_left_out_to_measure_what_they_gain() -> None:
    assert configured(SYSID_XLA_PLAIN="1") == "False []\n"


def test_another_release_of_jax_is_named_with_what_it_costs() -> None:
    said = configured(version="0.99.1")
    assert said.startswith("False")
    assert "JAX 0.99.1" in said
    assert "twenty times as long" in said
