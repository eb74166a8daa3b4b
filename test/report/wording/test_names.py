"""Names and statuses in words."""

import pytest

from sysid_node.report.wording.names import status_words


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ("contradicted", "contradicted by the last seconds of the flight"),
        ("contradicted: the online estimator finds -0.2 +- 0.01", "contradicted by the online estimator"),
        (
            "unconfirmed: collinear with q",
            "biased by gusts or a model error, and not known to the online estimator",
        ),
        ("dr not on time", "how late the rudder follows is not known well enough"),
        ("something new", "something new"),
    ],
)
def test_a_status_says_what_it_means(status: str, words: str) -> None:
    """An unknown one is returned as it is."""
    assert status_words(status) == words
