"""The table of parameters agrees with the estimator's settings and with the file that users read."""

from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from sysid_node.errors import InputError
from sysid_node.online.parameters import PARAMETERS, check, estimation_settings, identifier_yaml
from sysid_node.online.settings import OnlineSettings

ROOT = Path(__file__).resolve().parents[2]
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}


def test_every_setting_of_the_estimator_is_a_parameter_with_the_same_default() -> None:
    assert {field.name for field in fields(OnlineSettings)} <= DEFAULTS.keys()
    assert estimation_settings(DEFAULTS) == OnlineSettings()


def test_shipped_file_is_the_table() -> None:
    """`python -m sysid_node.online.parameters > config/identifier.yaml` writes it again."""
    assert (ROOT / "config" / "identifier.yaml").read_text(encoding="utf-8") == identifier_yaml()
    assert yaml.safe_load(identifier_yaml())["/**"]["ros__parameters"] == DEFAULTS


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_every_parameter_is_explained(parameter) -> None:
    assert parameter.meaning.endswith(".")
    assert parameter.change
    assert parameter.unit or not isinstance(parameter.default, float) or parameter.name == "valid_fraction"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("body_frame", "ned", "expected a string, flu | frd"),
        ("publish_rate", 0.0, "0.01 to 1000 Hz"),
        ("publish_rate", float("nan"), "0.01 to 1000 Hz"),
        ("method", "magic", "sls_rft"),
        ("frequencies", [2.0, 0.1, 1.0], "Hz"),
    ],
)
def test_wrong_values_are_named(name: str, value: object, words: str) -> None:
    with pytest.raises(InputError, match=name) as error:
        check({**DEFAULTS, name: value})
    assert words in str(error.value)
    assert "\n" not in str(error.value)
