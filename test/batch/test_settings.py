"""Settings of the batch methods, from texts."""

import pytest

from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError


def test_texts_become_values():
    settings = BatchSettings.from_mapping(
        {
            "frequencies": "0.2:0.1:3",
            "segment": "5",
            "use_prior": "true",
            "states": "alpha, q",
            "biases": "ax,az",
        }
    )
    assert settings == BatchSettings(
        frequencies=(0.2, 0.1, 3.0), segment=5.0, use_prior=True, states=("alpha", "q"), biases=("ax", "az")
    )
    assert BatchSettings.from_mapping(settings.as_dict("output_error")) == settings


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"window": "20"}, "setting 'window' is not one of a batch method; those are frequencies, low_pass"),
        ({"segment": "long"}, "setting segment = 'long': expected a float"),
        ({"segment": "-1"}, "setting segment = -1.0: expected a number, zero or more"),
        ({"rate": "nan"}, "setting rate = nan"),
        ({"use_prior": "maybe"}, "setting use_prior = 'maybe': expected a bool"),
        ({"frequencies": "1:2"}, "expected START:STEP:STOP in Hz"),
        ({"frequencies": "3:0.1:1"}, "expected 0 < start < stop"),
        ({"max_gap": "0"}, "setting max_gap = 0.0: expected seconds, more than zero"),
        ({"max_gap": "1e300"}, "expected seconds, more than zero and at most 3600"),
    ],
)
def test_what_cannot_be_is_refused(values, said):
    with pytest.raises(InputError, match=said):
        BatchSettings.from_mapping(values)
