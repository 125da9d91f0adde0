"""Messages of a process, as a relay with injected faults passes them on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.bags import RecordedMessage
from tfcompose.tools.treetest.faults import Injector, fault_of, pass_through

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from tfcompose.model.plan import Plan
    from tfcompose.tf.ros.tf_codec import Row
    from tfcompose.tools.treetest.injections import InjectionSpec


class RelayedMessages:
    """Changes the messages of a process by faults, each from its begin on.

    A message about fixed edges always has all of them, as that of a tf2 broadcaster: a late
    listener receives only the last one. A fault that begins changes those that were sent before.

    Args:
        injections: the faults, by numbers that ``begin`` takes.
        plan: the plan of the robot.
    """

    def __init__(self, injections: Mapping[int, InjectionSpec], plan: Plan) -> None:
        self._injectors = {
            number: Injector(fault_of(injection, plan)) for number, injection in injections.items()
        }
        self._fixed: dict[str, Row] = {}
        self._sent: dict[str, Row] = {}
        self._last_ns = 0
        #: Whether any message came.
        self.has_any = False

    def take(
        self, rows: Iterable[Row], *, static: bool, now_ns: int, clock_ns: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Take a message, and yield those to send.

        ``now_ns`` is the time in nanoseconds, and ``clock_ns`` that of the stamps, if another.
        """
        self.has_any = True
        if static:
            self._fixed |= {row[1]: row for row in rows}
            rows = self._fixed.values()
        yield from self._pass_on(tuple(rows), static=static, now_ns=now_ns, clock_ns=clock_ns)

    def pass_time(self, now_ns: int, clock_ns: int | None = None) -> Iterator[RecordedMessage]:
        """Yield the messages that are due."""
        yield from self._pass_on((), static=False, now_ns=now_ns, clock_ns=clock_ns)

    def begin(
        self, number: int, now_ns: int, clock_ns: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Begin a fault, and yield the messages to send."""
        self._injectors[number].begin_ns = 0
        if not self._fixed:
            return
        self._sent.clear()
        sent = list(
            self._pass_on(
                tuple(self._fixed.values()), static=True, now_ns=now_ns, clock_ns=clock_ns
            )
        )
        yield from sent
        if not any(message.static for message in sent):  # none is latched any more
            yield RecordedMessage(GLOBAL, (), static=True, received_ns=now_ns)

    def _pass_on(
        self, rows: tuple[Row, ...], *, static: bool, now_ns: int, clock_ns: int | None
    ) -> Iterator[RecordedMessage]:
        self._last_ns = max(self._last_ns, now_ns)  # a clock that is set back delays nothing
        message = RecordedMessage(GLOBAL, rows, static, self._last_ns, clock_ns)
        for changed in pass_through(self._injectors.values(), message):
            if changed.static:
                self._sent |= {row[1]: row for row in changed.rows or ()}
                yield replace(changed, rows=tuple(self._sent.values()))
            elif changed.rows:
                yield changed
