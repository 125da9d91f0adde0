"""A lifecycle node of another process: its state, queried and changed without blocking."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

if TYPE_CHECKING:
    from rclpy.node import Node

#: Maximum wait for an answer, and interval between requests, in seconds.
ANSWER_S = 5.0
ASK_EVERY_S = 0.2
#: Time before a failed transition is retried, in seconds.
TRY_AGAIN_S = 2.0

_NAMES = {
    State.PRIMARY_STATE_UNCONFIGURED: "unconfigured",
    State.PRIMARY_STATE_INACTIVE: "inactive",
    State.PRIMARY_STATE_ACTIVE: "active",
    State.PRIMARY_STATE_FINALIZED: "finalized",
}
_NEXT = {
    ("unconfigured", "inactive"): (Transition.TRANSITION_CONFIGURE, "configure"),
    ("unconfigured", "active"): (Transition.TRANSITION_CONFIGURE, "configure"),
    ("inactive", "active"): (Transition.TRANSITION_ACTIVATE, "activate"),
}


class Lifecycle:
    """A node, and its target state.

    Requests are sent and answers read directly, because nothing spins the node.
    """

    def __init__(self, node: Node, name: str, state: str, *, drive: bool) -> None:
        self._node = node
        self._name = name
        self._wanted = state
        self._drive = self._is_fresh = drive
        self._get: Any = node.create_client(GetState, f"{name}/get_state")
        self._change: Any = node.create_client(ChangeState, f"{name}/change_state")
        self._pending: tuple[Any, int, str] | None = None
        self._requested_at = 0.0
        self._not_before = 0.0
        self._state = ""
        self._fault = ""

    def close(self) -> None:
        """Destroy the clients."""
        self._node.destroy_client(self._get)
        self._node.destroy_client(self._change)

    @property
    def answers(self) -> bool:
        """Whether the node's state is known."""
        return bool(self._state)

    def ask_again(self) -> None:
        """Request the state again.

        A restarted node is brought into its state again, a deactivated node is not.
        """
        self._state, self._is_fresh = "", False

    def check(self, now: float) -> tuple[bool, str]:
        """Read answers, send requests, and return whether the node is in its target state."""
        self._take(now)
        if self._pending is None and self._state != self._wanted and now >= self._not_before:
            self._ask(now)
        return self._state == self._wanted, self._description()

    def _description(self) -> str:
        if not self._state:
            return f"{self._name} answers no lifecycle service"
        return f"{self._name} is {self._state}{self._fault}"

    def _ask(self, now: float) -> None:
        step = self._step()
        client, request, what = self._get, GetState.Request(), "state"
        if step:
            client, request, what = self._change, ChangeState.Request(), step[1]
            request.transition.id = step[0]
        if not client.service_is_ready():
            return
        with client.handle:
            sequence = client.handle.send_request(request)
        self._pending, self._requested_at = (client, sequence, what), now

    def _step(self) -> tuple[int, str] | None:
        """Return the next transition: its number and name, None without one."""
        self._is_fresh |= self._drive and self._state == "unconfigured"
        return _NEXT.get((self._state, self._wanted)) if self._is_fresh else None

    def _take(self, now: float) -> None:
        if self._pending is None:
            return
        client, sequence, what = self._pending
        with client.handle:
            header, response = client.handle.take_response(client.srv_type.Response)
        if header is None:
            if now - self._requested_at > ANSWER_S * (1 if what == "state" else 6):
                self._pending = None
            return
        if header.request_id.sequence_number != sequence:
            return
        self._pending = None
        if what == "state":
            self._state = _NAMES.get(response.current_state.id, response.current_state.label)
            self._not_before = now if self._step() else now + ASK_EVERY_S
        else:
            self._fault = "" if response.success else f", and does not {what}"
            self._state = "" if response.success else self._state
            self._not_before = now if response.success else now + TRY_AGAIN_S
            if not response.success:
                self._state = "unconfigured" if what == "configure" else "inactive"
