"""Flow separation near stall in a JSBSim model: the effect ``stall_separation``, with its memory.

The attached fraction of the flow is a lag filter of the flight control system, whose time constant follows cbar / V.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element

from sysid_node.sim.correcting.jsbsim_loads import Factor, Increments, less, one_over
from sysid_node.sim.correcting.xml_editing import product_of, text_element

_X = "fcs/corrected/attached"

#: The law's shape where the correction does not state it (``sim.effects.stall_separation``).
SHAPE = {"depth": 1.0, "alpha_star": 0.26, "a1": 20.0, "tau1": 10.0, "tau2": 3.0, "CD_X": 0.1, "Cm_X": -0.05}


def stall_channel(values: Mapping[str, float]) -> Element:
    """A channel of the flight control system that computes the attached fraction of the flow."""
    shape = {**SHAPE, **values}
    channel = Element("channel", name="corrected stall")
    steady = text_element(channel, "fcs_function", "", name="fcs/corrected/attached-steady")
    product = text_element(text_element(steady, "function", ""), "product", "")
    text_element(product, "value", 0.5)
    # (1 - tanh x) / 2 = 1 / (1 + exp 2x)
    product[0].text = "1.0"
    quotient = text_element(product, "quotient", "")
    text_element(quotient, "value", 1.0)
    below = text_element(quotient, "sum", "")
    text_element(below, "value", 1.0)
    exponent = text_element(text_element(below, "exp", ""), "product", "")
    text_element(exponent, "value", 2.0 * shape["a1"])
    late = text_element(exponent, "difference", "")
    text_element(late, "property", "aero/alpha-rad")
    # cbar / V is twice JSBSim's ci2vel
    product_of(late, ("aero/alphadot-rad_sec", "aero/ci2vel"), 2.0 * shape["tau2"])
    text_element(late, "value", shape["alpha_star"])
    corner = text_element(channel, "fcs_function", "", name="fcs/corrected/attached-rate")
    rate = text_element(text_element(corner, "function", ""), "quotient", "")
    text_element(rate, "value", 0.5 / shape["tau1"])
    text_element(rate, "property", "aero/ci2vel")
    lag = text_element(channel, "lag_filter", "", name=_X)
    text_element(lag, "input", "fcs/corrected/attached-steady")
    text_element(lag, "c1", "fcs/corrected/attached-rate")
    return channel


#: The model's own lift coefficient, of the frame before.
_OWN_LIFT: tuple[Factor, ...] = ("forces/fwz-aero-lbs", one_over("aero/qbar-psf", "metrics/Sw-sqft"))


def add_stall(found: Increments, values: Mapping[str, float], lift: tuple[Factor, ...] | None = _OWN_LIFT) -> None:
    """Lift lost, and drag and pitching moment added, of a model that had no such effect.

    ``lift`` are factors of the attached flow's lift coefficient; None where the lift is written by ``lift_factor``.
    """
    shape = {**SHAPE, **values}
    if lift is not None:
        found.add("CL", -shape["depth"], *lift, _lost)
    for name, size in (("CD", shape["CD_X"]), ("Cm", shape["Cm_X"])):
        found.add(name, -shape["depth"] * size, _less_one)


def lift_factor(product: Element, values: Mapping[str, float]) -> None:
    """Lift as a fraction of the attached flow's, as a factor of a product: 1 - depth (1 - ((1 + sqrt X) / 2)^2)."""
    difference = text_element(product, "difference", "")
    text_element(difference, "value", 1.0)
    _lost(product_of(difference, [], {**SHAPE, **values}["depth"]))


_less_one: Factor = less(_X, 1.0)


def _lost(parent: Element) -> None:
    """The factor 1 - ((1 + sqrt X) / 2)^2."""
    difference = text_element(parent, "difference", "")
    text_element(difference, "value", 1.0)
    power = text_element(difference, "pow", "")
    half = text_element(text_element(power, "product", ""), "sum", "")
    text_element(half, "value", 0.5)
    root = text_element(half, "product", "")
    text_element(root, "value", 0.5)
    square_root = text_element(root, "pow", "")
    text_element(square_root, "property", _X)
    text_element(square_root, "value", 0.5)
    text_element(power, "value", 2.0)
