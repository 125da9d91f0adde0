"""Loading and unloading of components in containers, with or without orders of a launcher.

A container gets one request at a time, in the order of the orders. Exported systemd units and
containers run without a launcher. There, the guard periodically checks each container and loads
missing components, even after a container restarts.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from tfcompose.model.messages import ComponentOrder, ComponentState
from tfcompose.model.plan.components import LoadRequest, load_request
from tfcompose.tf.process import say

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node

    from tfcompose.model.messages import GuardEvent, LoadState
    from tfcompose.tf.process import OwnProcess
    from tfcompose.tf.ros.composition import Container

#: Maximum time for a container's answer to a request to unload, in seconds.
ANSWER_S = 5.0
#: If an answer is missing for this time, in seconds, it may be lost. Then the guard also asks for
#: the container's list of components.
LIST_AFTER_S = 2.0
#: A component may be missing from the list this often. If it is missing more often, it was
#: unloaded, or the request to load it was lost.
ABSENT_AT_MOST = 1
#: Interval between checks that a container has its components, in seconds.
CHECK_EVERY_S = 2.0


@dataclass(slots=True)
class _Job:
    """An order and its progress."""

    order: ComponentOrder
    request: LoadRequest
    #: The pending request; empty before the first request.
    step: str = ""
    #: Begin of the step, in monotonic seconds.
    since: float = 0.0
    #: Time of the last request for the container's list, in monotonic seconds.
    listed: float = 0.0
    #: Number of lists that lacked the component.
    absent: int = 0


class Components:
    """Pending orders by container, and the loaded components.

    A component that is missing from its container is reported as unloaded. Either another program
    unloaded it, or the container was replaced without the launcher.
    """

    def __init__(self, node: Node, emit: Callable[[GuardEvent], None]) -> None:
        self._node = node
        self._emit = emit
        self._containers: dict[str, Container] = {}
        self._jobs: dict[str, deque[_Job]] = {}
        self._loaded: dict[str, tuple[ComponentOrder, LoadRequest]] = {}
        self._absent: dict[str, int] = {}
        self._due = 0.0

    def take(self, order: ComponentOrder) -> None:
        """Execute an order of the launcher. It replaces an order for the same component."""
        try:
            request = msgspec.json.decode(Path(order.file).read_bytes(), type=LoadRequest)
        except (OSError, UnicodeDecodeError, msgspec.DecodeError) as error:
            self._answer(order, f"{order.file} cannot be read: {error}")
            return
        self.add(order, request)

    def add(self, order: ComponentOrder, request: LoadRequest) -> None:
        """Execute an order about a component, or answer that components cannot be loaded."""
        try:
            self._container(request.container)
        except ImportError:
            self._answer(
                order, "composition_interfaces cannot be imported, which comes with the containers"
            )
            return
        self.forget(order.process)
        jobs = self._jobs.setdefault(request.container, deque())
        jobs.append(_Job(order, request, since=time.monotonic()))

    def forget(self, process: str) -> None:
        """Drop orders about the component, because it was stopped or its container has ended."""
        self._loaded.pop(process, None)
        for name, jobs in self._jobs.items():
            self._jobs[name] = deque(job for job in jobs if job.order.process != process)

    def has(self, process: str) -> bool:
        """Return whether an order about the component is pending."""
        return any(job.order.process == process for jobs in self._jobs.values() for job in jobs)

    def check(self) -> None:
        """Read answers, and send the next requests."""
        now = time.monotonic()
        for name, jobs in self._jobs.items():
            while jobs and self._is_done(jobs[0], self._containers[name], now):
                jobs.popleft()
        if now >= self._due:
            self._due = now + CHECK_EVERY_S
            for name, container in self._containers.items():
                if not self._jobs[name]:
                    self._check_loaded(name, container)

    def _check_loaded(self, name: str, container: Container) -> None:
        """Read the container's list of components, and request it again."""
        loaded = [entry for entry in self._loaded.values() if entry[1].container == name]
        listing, is_there = container.list.answer(), container.list.is_there
        for order, request in loaded if listing or not is_there else ():
            is_absent = listing is None or request.node not in listing.full_node_names
            self._absent[order.process] = is_absent * (self._absent.get(order.process, 0) + 1)
            if self._absent[order.process] > ABSENT_AT_MOST:
                del self._loaded[order.process]
                self._emit(
                    ComponentState(
                        order.process,
                        order.number,
                        "unloaded",
                        f"{name} has no {request.node} any more",
                    )
                )
        if loaded and is_there:
            container.list.ask()

    def _container(self, name: str) -> Container:
        # Only plans with containers need its message types.
        from tfcompose.tf.ros.composition import Container  # noqa: PLC0415

        if name not in self._containers:
            self._containers[name] = Container(self._node, name)
        return self._containers[name]

    def _is_done(self, job: _Job, container: Container, now: float) -> bool:
        """Continue an order, and return whether it is answered."""
        if job.order.do == "load":
            return self._is_loaded(job, job.order, container, now)
        return self._is_unloaded(job, job.order, container, now)

    def _is_loaded(
        self, job: _Job, order: ComponentOrder, container: Container, now: float
    ) -> bool:
        if not container.load.is_there:
            if job.step:
                self._answer(order, f"{container.name} went away")
            return bool(job.step)
        if not job.step:
            return not self._begins(job, container, now, "look")
        if job.step == "load" and (answer := container.load.answer()) is not None:
            reason = answer.error_message or "it does not say why"
            why = (
                ""
                if answer.success
                else f"{container.name} did not load {job.request.what}: {reason}"
            )
            self._finish_load(job, order, why)
            return True
        if (listing := container.list.answer()) is not None:
            if job.request.node in listing.full_node_names:
                before = job.step == "look" and not order.again
                self._finish_load(job, order, _already(job.request, listing) if before else "")
                return True
            job.absent += 1
            if (
                job.step == "look" or job.absent > ABSENT_AT_MOST
            ):  # a container handles requests in sequence
                return not self._begins(job, container, now, "load")
        elif now - max(job.since, job.listed) > LIST_AFTER_S and container.list.is_there:
            job.listed = now
            container.list.ask()
        return False

    def _begins(self, job: _Job, container: Container, now: float, step: str) -> bool:
        """Request the container's list, or request to load the component.

        Return False if the request is impossible. In that case the order is answered.
        """
        if step == "look" and not container.list.is_there:
            return True
        job.step, job.since, job.absent = step, now, 0
        try:
            if step == "look":
                container.list.ask()
            else:
                container.ask_to_load(job.request)
        except ValueError as error:
            self._answer(job.order, str(error))
            return False
        return True

    def _is_unloaded(
        self, job: _Job, order: ComponentOrder, container: Container, now: float
    ) -> bool:
        if now - job.since > ANSWER_S:
            self._answer(order, f"{container.name} does not answer")
            return True
        if not job.step:
            if container.list.is_there:
                job.step = "list"
                container.list.ask()
        elif job.step == "list" and (listing := container.list.answer()) is not None:
            named = dict(zip(listing.full_node_names, listing.unique_ids, strict=False))
            if job.request.node not in named:
                self._answer(order, "")
                return True
            job.step = "unload"
            container.unload.ask(unique_id=named[job.request.node])
        elif job.step == "unload" and (answer := container.unload.answer()) is not None:
            self._answer(
                order, "" if answer.success else f"{container.name}: {answer.error_message}"
            )
            return True
        return False

    def _finish_load(self, job: _Job, order: ComponentOrder, why: str) -> None:
        if not why:
            self._loaded[order.process] = order, job.request
            self._absent[order.process] = 0
        self._answer(order, why)

    def _answer(self, order: ComponentOrder, why: str) -> None:
        state: LoadState = "unloaded"
        if order.do == "load":
            state = "not loaded" if why else "loaded"
        self._emit(ComponentState(order.process, order.number, state, why))


def _already(request: LoadRequest, listing: Any) -> str:
    """Return why a component is not loaded: the container already has a node with its name."""
    number = listing.unique_ids[list(listing.full_node_names).index(request.node)]
    unload = f"ros2 component unload {request.container} {number}"
    return (
        f"{request.container} has a node {request.node} already, which is not of this run:"
        f" {unload}"
    )


class ComponentDriver:
    """Loads the plan's components without orders of a launcher."""

    def __init__(self, node: Node, own_process: OwnProcess, *, private: bool) -> None:
        def fill(text: str) -> str:
            return text.replace("${build_dir}", str(own_process.file.absolute().parent))

        self._requests = {
            process.name: load_request(own_process.plan, process, fill, private=private)
            for process in own_process.plan.components
        }
        self._components = Components(node, self._hear)
        self._due = 0.0
        self._printed: dict[str, str] = {}

    def check(self) -> None:
        """Order the missing components from each container, and print changes."""
        now = time.monotonic()
        if now >= self._due:
            self._due = now + CHECK_EVERY_S
            for name, request in self._requests.items():
                if not self._components.has(name):
                    self._components.add(ComponentOrder(name, 0, "load", again=True), request)
        self._components.check()

    def _hear(self, event: GuardEvent) -> None:
        match event:
            case ComponentState(name, state="loaded"):
                self._say(name, f"{name} is in {self._requests[name].container}")
            case ComponentState(name, state="not loaded", why=why):
                self._say(name, why)
            case _:
                pass

    def _say(self, name: str, what: str) -> None:
        if self._printed.get(name) != what:
            self._printed[name] = what
            say(what)
