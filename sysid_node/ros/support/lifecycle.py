"""A lifecycle node that says what went wrong: rclpy's swallows it, and some requests kill it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from sysid_node.errors import InputError


class CarefulNode(LifecycleNode):
    """Transitions by plain methods that may raise, and callbacks that may raise.

    A subclass overrides ``configure`` and ``cleanup``. An InputError in one of them is one line in the log and a failed
    transition; any other exception is logged with its traceback and sends the node through error processing to
    `unconfigured`. So does an exception in a callback wrapped by ``guarded``, as soon as
    ``settle`` runs. ``fault`` says in one line what happened last, until the node is configured again.
    """

    def __init__(self, name: str) -> None:
        self.active = False
        self.fault = ""
        self.faults = 0
        super().__init__(name)

    def configure(self) -> None:
        """Make what the node needs, from its parameters."""

    def cleanup(self) -> None:
        """Give up what ``configure`` made; whatever state that left behind."""

    @property
    def state_label(self) -> str:
        """The lifecycle state: unconfigured, inactive, active or finalized; or a transition's name meanwhile."""
        return str(self._state_machine.current_state[1])

    def guarded(self, callback: Callable[..., None]) -> Callable[..., None]:
        """The callback, heard while the node is active; its first exception stops all guarded ones."""

        def call(*arguments: Any) -> None:
            if not self.active:
                return
            try:
                callback(*arguments)
            except Exception as error:
                if self.context.ok():  # otherwise something was asked of ROS while it shuts down
                    self._record(callback.__name__, error)

        return call

    def answered(self, request: Callable[[], str]) -> Callable[[Any, Any], Any]:
        """A service callback of type std_srvs/Trigger: what ``request`` returns, or raises, is the answer."""

        def call(_: Any, response: Any) -> Any:
            try:
                response.message, response.success = request(), True
            except InputError as error:
                response.message = str(error)
            except Exception as error:
                self._record(request.__name__, error)
                response.message = self.fault
            return response

        return call

    def settle(self) -> None:
        """Leave `active` after a fault. Call it from a timer: a subscription cannot be destroyed in its callback."""
        if self.fault and self.state_label == "active":
            self.trigger_deactivate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``configure``."""
        self.fault = ""
        return self._transition(self.configure, super().on_configure, state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start hearing."""
        result = super().on_activate(state)
        self.active = result == TransitionCallbackReturn.SUCCESS
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop hearing. ERROR where a fault is the reason."""
        self.active = False
        result = super().on_deactivate(state)
        return TransitionCallbackReturn.ERROR if self.fault else result

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``cleanup``."""
        return self._transition(self.cleanup, super().on_cleanup, state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``cleanup``; the last transition."""
        self.active = False
        return self._transition(self.cleanup, super().on_shutdown, state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Clean up, so that the node can be configured again."""
        return self._transition(self.cleanup, super().on_error, state)

    def _transition(
        self,
        work: Callable[[], None],
        entities: Callable[[LifecycleState], TransitionCallbackReturn],
        state: LifecycleState,
    ) -> TransitionCallbackReturn:
        try:
            work()
            return entities(state)
        except InputError as error:
            self.fault = str(error)
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self._record(work.__name__, error)
            return TransitionCallbackReturn.ERROR

    def _record(self, where: str, error: Exception) -> None:
        self.active = False
        self.faults += 1
        self.fault = f"{where}: {type(error).__name__}: {error}"
        self.get_logger().error(f"{self.fault}\n{''.join(traceback.format_exception(error))}")

    def _LifecycleNodeMixin__on_change_state(self, request: Any, response: Any) -> Any:
        """Answer a request that the present state does not allow; rclpy lets it end the process (its issue 1209)."""
        try:
            return super()._LifecycleNodeMixin__on_change_state(request, response)
        except rclpy_implementation.RCLError:
            wanted = request.transition.label or request.transition.id
            self.get_logger().warning(f"transition {wanted!r} is not possible in state {self.state_label!r}; ignored")
            response.success = False
            return response
