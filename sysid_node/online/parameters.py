"""The parameters of the node ``identifier`` as a table: the estimator's settings, and what the node needs besides.

``python -m sysid_node.online.parameters > config/identifier.yaml`` writes the file that users read.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from sysid_node.flight.commanded import CARRIED
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter, annotated_yaml, check_each

_ESTIMATOR = OnlineSettings()

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    NodeParameter(
        "publish_rate",
        20.0,
        "Hz",
        "Estimates published per second of flight, by the stamps of the data; the estimator itself takes every sample.",
        "Up for a controller that adapts quickly, down for a slow radio link.",
        lower=0.01,
        upper=1000.0,
    ),
    NodeParameter(
        "stale_after",
        0.5,
        "s",
        "A topic silent for longer is reported as stale on /diagnostics.",
        "Up where a sensor publishes more slowly than twice a second.",
        lower=0.01,
        upper=3600.0,
    ),
    NodeParameter(
        "save_directory",
        ".",
        "",
        "Folder that ~/save writes estimates into (~ is the home); made where it is missing. May change at any time.",
        "To keep estimates where they survive the flight.",
    ),
    NodeParameter(
        "autostart",
        True,
        "",
        "Configure and activate at the start; an unusable parameter then ends the process. false: wait for requests.",
        "false where a lifecycle manager starts the nodes in order.",
    ),
    NodeParameter(
        "frequencies",
        list(_ESTIMATOR.frequencies),
        "Hz",
        "Lines of the Fourier transform: first, step, last. Motion outside this band is left out.",
        "Last: above short period and Dutch roll, below structural modes and noise. First: above slow drift.",
    ),
    NodeParameter(
        "method",
        _ESTIMATOR.method,
        "",
        "sls_rft: least squares. iv_rft: instrumental variables, unbiased by noise on the flow angles, less precise.",
        "iv_rft where vanes are noisy beside the motion or the air is turbulent, in which sls_rft has wide intervals.",
        choices=METHODS,
    ),
    NodeParameter(
        "forgetting_time",
        _ESTIMATOR.forgetting_time,
        "s",
        "Older data count e^-1 after this time; 0 = nothing is forgotten.",
        "30 to 120 where the aircraft changes slowly (fuel, speed, icing). Not together with window.",
        lower=0.0,
        upper=86400.0,
    ),
    NodeParameter(
        "window",
        _ESTIMATOR.window,
        "s",
        "Only the last so many seconds count; 0 = the whole record.",
        "Where old data must be gone for certain rather than fade. Not together with forgetting_time.",
        lower=0.0,
        upper=86400.0,
    ),
    NodeParameter(
        "settle_time",
        _ESTIMATOR.settle_time,
        "s",
        "Left out at the start, while filters settle.",
        "Up where the sensors' own filters start slowly.",
        lower=0.0,
        upper=3600.0,
    ),
    NodeParameter(
        "max_gap",
        _ESTIMATOR.max_gap,
        "s",
        "The longest gap in air data or actuators across which samples are interpolated.",
        "Up where air data come at less than 10 Hz.",
        lower=0.001,
        upper=5.0,
    ),
    NodeParameter(
        "actuators",
        _ESTIMATOR.actuators,
        "",
        "What the topic actuators carries. commands are held from message to message, and the aircraft file's servos "
        "follow them; positions are interpolated. auto: by the messages; commands jump, and surfaces do not.",
        "commands or positions where it is known: auto begins anew when it finds commands.",
        choices=CARRIED,
    ),
    NodeParameter(
        "use_prior",
        _ESTIMATOR.use_prior,
        "",
        "Whether the aircraft file's derivatives count as measurements, each by its tolerance.",
        "true where early estimates matter and the file is trusted.",
    ),
    NodeParameter(
        "detect_changes",
        _ESTIMATOR.detect_changes,
        "",
        "Whether to look for abrupt changes of the aircraft, and to forget what was before.",
        "false to average over the whole flight whatever happens.",
    ),
    NodeParameter(
        "valid_fraction",
        _ESTIMATOR.valid_fraction,
        "",
        "A derivative is valid once its standard error is under this share of its size: of the aircraft file's value, "
        "or of twice its tolerance where that is more.",
        "Down for a controller that needs precise values, up for one that needs them early.",
        lower=0.001,
        upper=100.0,
    ),
)

_ESTIMATION = frozenset(field.name for field in fields(OnlineSettings))

#: Parameters that may change while the node is configured.
LIVE = frozenset({"save_directory", "stale_after"})


def estimation_settings(values: Mapping[str, Any]) -> OnlineSettings:
    """The estimator's settings among the node's parameters. Raises InputError on an impossible combination."""
    return OnlineSettings.from_mapping({name: value for name, value in values.items() if name in _ESTIMATION})


def check(values: Mapping[str, Any]) -> None:
    """Check values of all parameters. Raises InputError naming the first wrong one, its value and what is expected."""
    check_each(PARAMETERS, values)
    estimation_settings(values)


EFFECT = "They take effect when the node is configured; to change one later: ros2 lifecycle set /identifier cleanup."


def identifier_yaml() -> str:
    """The text of config/identifier.yaml."""
    return annotated_yaml("identifier", PARAMETERS, EFFECT)


if __name__ == "__main__":
    print(identifier_yaml(), end="")
