"""What libraries raise and print about a damaged log is one line."""

import os
import sys

import pytest

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.logs.damage import reading_log


def test_lines_of_python_and_of_compiled_code_are_one_warning(capfd):
    def read():
        with reading_log("flights/00000007.BIN"):
            print("bad header 0x0000 at 12")
            print("bad header 0x0001 at 13", file=sys.stderr)
            os.write(2, b"bad header 0x0002 at 14\n")  # as compiled code does

    with pytest.warns(
        InputWarning, match=r"00000007.BIN: is damaged in 3 places, which are left out, first: bad header"
    ):
        read()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("error", [KeyError("Name"), ValueError("invalid\nliteral"), RecursionError(), MemoryError()])
def test_an_error_is_one_line_that_names_the_file(error, capfd):
    with pytest.raises(InputError, match=r"x\.ulg: is damaged and cannot be read") as caught, reading_log("x.ulg"):
        raise error
    assert "\n" not in str(caught.value)
    print("heard again", file=sys.stderr)
    assert capfd.readouterr().err == "heard again\n"


def test_a_missing_package_stays_its_own_error():
    with pytest.raises(ImportError), reading_log("x.ulg"):
        raise ImportError("pyulog")
