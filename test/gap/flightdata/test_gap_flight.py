"""Flights made ready: what is filtered is what was flown."""

from dataclasses import replace

import numpy as np

from sysid_node.gap.flightdata.gap_flight import resampled


def test_a_heading_through_south_is_not_smeared(plain) -> None:
    """A turn of a full circle in the record's range of half turns, against the same without the jump."""
    heading = np.linspace(2.0, 2.0 + 2.0 * np.pi, len(plain.record))
    turned = (resampled(replace(plain, record=replace(plain.record, columns={**plain.record.columns, "psi": psi})))
              for psi in (heading, (heading + np.pi) % (2.0 * np.pi) - np.pi))  # fmt: skip
    whole, jumping = (record["psi"] for record in turned)
    np.testing.assert_allclose(jumping, whole, atol=1e-9)
