"""Rows of estimates, made when first looked at."""

import pickle

import numpy as np

from sysid_node.online.estimates.rows import DerivativeRows, FitRows
from sysid_node.online.status import NOT_EXCITED, OK, WORDS, Vocabulary
from sysid_node.online.types import DerivativeEstimate, FitQuality

NUMBERS = np.array([[-1.0, 0.1, 0.08, 0.06, -1.2, -0.8], [0.5, np.inf, np.inf, 0.0, -np.inf, np.inf]])
ROWS = {
    "Cm_q": DerivativeEstimate("Cm_q", -1.0, 0.1, -1.2, -0.8, True, "ok", 0.08, 0.06),
    "Cm_de": DerivativeEstimate("Cm_de", 0.5, np.inf, -np.inf, np.inf, False, "not excited", np.inf, 0.0),
}


def rows() -> DerivativeRows:
    codes = np.array([OK, NOT_EXCITED], np.uint8)
    return DerivativeRows(("Cm_q", "Cm_de"), NUMBERS, codes, Vocabulary(WORDS, len(WORDS)))


def test_are_the_mapping_that_a_dictionary_of_them_is():
    assert rows() == ROWS and list(rows()) == list(ROWS) and len(rows()) == 2
    assert isinstance(rows()["Cm_q"].value, float) and rows()["Cm_q"].valid is True
    fits = FitRows(("Cm",), np.array([[0.9, 1e-3, 7.5, 12.0]]))
    assert fits == {"Cm": FitQuality("Cm", 0.9, 1e-3, 7.5, 12)}


def test_are_a_plain_dictionary_once_they_were_pickled():
    copied = pickle.loads(pickle.dumps(rows()))
    assert type(copied) is dict and copied == ROWS


def test_say_what_they_hold():
    assert repr(rows()) == repr(ROWS)
