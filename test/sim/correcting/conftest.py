"""JSBSim's c172p, surveyed once a module."""

import pytest


@pytest.fixture(scope="module")
def survey():
    pytest.importorskip("jsbsim", reason="JSBSim is not installed")
    from sysid_node.sim.importing.jsbsim.survey import survey_model  # noqa: PLC0415

    return survey_model("c172p", 52.0, 900.0)


@pytest.fixture(scope="module")
def file(survey):
    from corrected_model import file_of  # noqa: PLC0415

    return file_of(survey)
