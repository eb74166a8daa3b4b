"""Settings: texts and values parsed alike, and one clear line for each impossible one."""

from dataclasses import fields
from typing import Any

import pytest

from sysid_node.errors import InputError
from sysid_node.online.settings import OnlineSettings


def test_texts_and_values_are_parsed_alike() -> None:
    texts = {
        "frequencies": "0.2:0.1:1.5",
        "method": "sls_rft",
        "window": "30",
        "use_prior": "yes",
        "detect_changes": "0",
    }
    values = {
        "frequencies": [0.2, 0.1, 1.5],
        "method": "sls_rft",
        "window": 30,
        "use_prior": True,
        "detect_changes": False,
    }
    expected = OnlineSettings((0.2, 0.1, 1.5), "sls_rft", window=30.0, use_prior=True, detect_changes=False)
    assert OnlineSettings.from_mapping(texts) == OnlineSettings.from_mapping(values) == expected
    assert OnlineSettings.from_mapping({}) == OnlineSettings()


def test_plain_values_come_back() -> None:
    settings = OnlineSettings(window=12.0)
    assert list(settings.as_dict()) == [field.name for field in fields(OnlineSettings)]
    assert OnlineSettings.from_mapping(settings.as_dict()) == settings


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("colour", "red", "'colour' is not known"),
        ("frequencies", "0.1:2.0", "START:STEP:STOP"),
        ("frequencies", "a:b:c", "START:STEP:STOP"),
        ("frequencies", 3.0, "START:STEP:STOP"),
        ("frequencies", "0:0.1:2", "0 < start < stop"),
        ("frequencies", "2:0.1:1", "0 < start < stop"),
        ("frequencies", "0.1:nan:1", "step > 0"),
        ("frequencies", "0.1:0.1:inf", "0 < start < stop"),
        ("frequencies", "0.1:1e-3:2", "at most 1000 lines"),
        ("frequencies", "0.1:1e-7:2", "at most 100000 lines"),
        ("method", "magic", "sls_rft, iv_rft"),
        ("forgetting_time", "-1", "zero or more"),
        ("forgetting_time", "nan", "zero or more"),
        ("forgetting_time", "0.01", "at least 1 s"),
        ("window", "inf", "zero or more"),
        ("forgetting_time", "1e18", "at most 1e+06"),
        ("settle_time", "soon", "a float"),
        ("max_gap", "0", "more than 0"),
        ("max_gap", "60", "at most 5"),
        ("max_gap", "nan", "more than 0"),
        ("use_prior", "perhaps", "a bool"),
        ("valid_fraction", "0", "positive"),
        ("valid_fraction", "nan", "positive"),
        ("valid_fraction", None, "a float"),
    ],
)
def test_what_is_impossible_is_said_in_one_line(key: str, value: Any, words: str) -> None:
    with pytest.raises(InputError) as error:
        OnlineSettings.from_mapping({key: value})
    text = str(error.value)
    assert words in text
    assert key in text
    assert "\n" not in text


def test_one_way_to_forget_at_a_time() -> None:
    with pytest.raises(InputError, match="one of them"):
        OnlineSettings(forgetting_time=20.0, window=20.0)
