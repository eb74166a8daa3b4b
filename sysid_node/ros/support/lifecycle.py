"""A lifecycle node that reports its errors. rclpy's own swallows exceptions, and some requests end its process."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from sysid_node.errors import InputError


class CarefulNode(LifecycleNode):
    """A lifecycle node whose transitions are plain methods; transitions and callbacks may raise exceptions.

    A subclass overrides ``configure`` and ``cleanup``. An InputError in one of them is logged in one line, and the
    transition fails. Any other exception is logged with its traceback and takes the node through error processing to
    `unconfigured`. So does an exception in a callback that is wrapped by ``guarded``, as soon as ``settle`` runs.
    ``fault`` is one line about the last error, until the node is configured again.
    """

    def __init__(self, name: str) -> None:
        self.active = False
        self.fault = ""
        self.faults = 0
        super().__init__(name)

    def configure(self) -> None:
        """Make what the node needs, by its parameters."""

    def cleanup(self) -> None:
        """Destroy what ``configure`` made, even where it did not finish."""

    @property
    def state_label(self) -> str:
        """The lifecycle state: unconfigured, inactive, active or finalized, or the name of a transition under way."""
        return str(self._state_machine.current_state[1])

    def guarded(self, callback: Callable[..., None]) -> Callable[..., None]:
        """The callback, called only while the node is active. The first exception stops all guarded callbacks."""

        def call(*arguments: Any) -> None:
            if not self.active:
                return
            try:
                callback(*arguments)
            except Exception as error:
                if self.context.ok():  # otherwise ROS is shutting down, and its calls may fail
                    self._record(callback.__name__, error)

        return call

    def answered(self, request: Callable[[], str]) -> Callable[[Any, Any], Any]:
        """A callback for a std_srvs/Trigger service, which answers with what ``request`` returns or raises."""

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
        """Leave the state active after a fault. Called by a timer: a callback cannot destroy its own subscription."""
        if self.fault and self.state_label == "active":
            self.trigger_deactivate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``configure``."""
        self.fault = ""
        return self._transition(self.configure, super().on_configure, state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start to take messages."""
        result = super().on_activate(state)
        self.active = result == TransitionCallbackReturn.SUCCESS
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop taking messages. Returns ERROR where a fault is the reason."""
        self.active = False
        result = super().on_deactivate(state)
        return TransitionCallbackReturn.ERROR if self.fault else result

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``cleanup``."""
        return self._transition(self.cleanup, super().on_cleanup, state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """See ``cleanup``. This is the last transition."""
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
            if not self.context.ok():  # interrupted: whatever it was about to do fails, which is no fault
                return TransitionCallbackReturn.ERROR
            self._record(work.__name__, error)
            return TransitionCallbackReturn.ERROR

    def _record(self, where: str, error: Exception) -> None:
        self.active = False
        self.faults += 1
        self.fault = f"{where}: {type(error).__name__}: {error}"
        self.get_logger().error(f"{self.fault}\n{''.join(traceback.format_exception(error))}")

    def _LifecycleNodeMixin__on_change_state(self, request: Any, response: Any) -> Any:
        """Answer a request that the present state does not allow, which would end the process (issue 1209 of rclpy)."""
        try:
            return super()._LifecycleNodeMixin__on_change_state(request, response)
        except rclpy_implementation.RCLError:
            wanted = request.transition.label or request.transition.id
            self.get_logger().warning(f"transition {wanted!r} is not possible in state {self.state_label!r}; ignored")
            response.success = False
            return response
