"""A careful node: what goes wrong is said, survives, and can be started again."""

import pytest
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import TransitionCallbackReturn

from sysid_node.errors import InputError
from sysid_node.ros.support.lifecycle import CarefulNode

SUCCESS, FAILURE, ERROR = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
    TransitionCallbackReturn.ERROR,
)


class Fragile(CarefulNode):
    def __init__(self) -> None:
        super().__init__("fragile")
        self.trouble: Exception | None = None
        self.cleaned = 0

    def configure(self) -> None:
        if self.trouble:
            raise self.trouble

    def cleanup(self) -> None:
        self.cleaned += 1


@pytest.fixture
def node(ros):
    one = Fragile()
    yield one
    one.destroy_node()


def test_bad_input_fails_the_transition_and_the_node_can_try_again(node) -> None:
    node.trouble = InputError("aircraft 'x' is not known")
    assert node.trigger_configure() == FAILURE
    assert (node.state_label, node.fault) == ("unconfigured", "aircraft 'x' is not known")
    node.trouble = None
    assert node.trigger_configure() == SUCCESS
    assert (node.state_label, node.fault) == ("inactive", "")


def test_an_exception_in_a_transition_is_an_error_that_is_cleaned_up(node) -> None:
    node.trouble = ZeroDivisionError("oops")
    assert node.trigger_configure() == ERROR
    assert (node.state_label, node.cleaned, node.faults) == ("unconfigured", 1, 1)
    assert node.fault == "configure: ZeroDivisionError: oops"


def test_an_exception_in_a_callback_stops_all_and_settles_to_unconfigured(node) -> None:
    heard = []

    def fragile(message) -> None:
        heard.append(message)
        raise KeyError("gone")

    bad, good = node.guarded(fragile), node.guarded(heard.append)
    good(0)
    assert heard == [], "heard before it was active"
    node.trigger_configure()
    node.trigger_activate()
    good(1)
    bad(2)
    bad(3)
    good(4)
    assert heard == [1, 2]
    assert node.fault == "fragile: KeyError: 'gone'"
    node.settle()
    assert (node.state_label, node.faults) == ("unconfigured", 1)
    node.trigger_configure()
    node.trigger_activate()
    good(5)
    assert heard == [1, 2, 5]


def test_deactivated_it_does_not_hear(node) -> None:
    heard = []
    callback = node.guarded(heard.append)
    node.trigger_configure()
    node.trigger_activate()
    node.trigger_deactivate()
    callback(1)
    assert heard == []


@pytest.mark.parametrize(("id_", "label"), [(99, ""), (3, ""), (0, "nonsense")])
def test_an_impossible_request_is_refused(node, id_: int, label: str) -> None:
    """Id 3 (activate) is impossible while unconfigured. Answered by rclpy itself, such requests raise (its #1209)."""
    request = ChangeState.Request()
    request.transition.id, request.transition.label = id_, label
    response = node._LifecycleNodeMixin__on_change_state(request, ChangeState.Response())
    assert not response.success
    assert node.state_label == "unconfigured"
