"""Lifecycle of components: nodes that containers load and unload on request of the guard.

A component has no process in the operating system. It starts with an order to the guard, runs once
its container has answered, and ends with the container. A restarted guard receives the orders
again.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import finding
from tfcompose.launcher.events import Order
from tfcompose.launcher.readiness import order_gate
from tfcompose.launcher.stopping import lose_edges, process_left, schedule_restart
from tfcompose.model.messages import ComponentOrder, ComponentState

if TYPE_CHECKING:
    from tfcompose.launcher.state import State, Tracked, Transition


def take_component_answer(step: Transition, event: ComponentState) -> None:
    """Handle a container's answer to the last order about a component."""
    tracked, why = step.state.tracked[event.process], event.why
    match event.state:
        case "loaded" if tracked.state == "starting":
            container = (
                tracked.process.component
                and step.state.tracked[tracked.process.component.container]
            )
            step.enter(
                event.process, "running", pid=container.pid if container else None, began=step.now
            )
            order_gate(step, step.state.tracked[event.process])
        case "not loaded" if tracked.state == "starting":
            _end_component(
                step,
                replace(tracked, since=step.now),
                why,
                f"{tracked.process.name} could not be started: {why}",
            )
        case "unloaded" if tracked.state == "running":
            _end_component(step, tracked, why, f"{tracked.process.name} has ended: {why}")
        case "unloaded" if tracked.state == "stopping" and step.state.stop:
            step.enter(event.process, "stopped", why)
        case "unloaded" if tracked.state == "stopping":
            process_left(step, tracked, why or "unloaded")
        case _:
            pass


def _end_component(step: Transition, tracked: Tracked, why: str, message: str) -> None:
    """Handle a component that is not loaded: load it again, or let it fail."""
    name = tracked.process.name
    if step.state.stop:
        step.enter(name, "stopped", why)
        return
    lose_edges(step, tracked)
    tracked = step.state.tracked[name]
    if tracked.leaving:
        process_left(step, tracked, why)
    elif tracked.process.restart == "no":
        step.enter(name, "fatal", why)
        step.fail_process(name, finding("TF808", message, None))
    else:
        schedule_restart(
            step, tracked, why, lambda when: finding("TF808", f"{message}{when}", None)
        )


def order_components(step: Transition) -> None:
    """Repeat orders about components to a guard that has just started.

    The previous guard may not have finished them. Orders of type ``Absent`` come first, because
    they make the guard drop other orders about these components.
    """
    for name, tracked in step.state.tracked.items():
        if tracked.process.component and tracked.state in (
            "starting",
            "running",
        ):  # the guard also watches components that run
            step.actions.append(Order(ComponentOrder(name, tracked.order, "load", again=True)))
        elif tracked.process.component and tracked.state == "stopping":
            step.actions.append(Order(ComponentOrder(name, tracked.order, "unload")))


#: A logger's name, which ROS writes in brackets at the start of a line.
_LOGGER = re.compile(r"\[([\w.]+)\]")
_BEGINNING = 300


def writer_of(state: State, process: str, line: str) -> str:
    """Return the process that wrote a line.

    A line from a container belongs to the component whose logger the line names.
    """
    components = state.components_of(process)
    if not components:
        return process
    loggers = {
        node.strip("/").replace("/", "."): component.process.name
        for component in components
        for node in component.process.nodes
    }
    for name in _LOGGER.findall(line[:_BEGINNING]):
        logger_name = next(
            (logger for logger in loggers if name == logger or name.startswith(f"{logger}.")), None
        )
        if logger_name:
            return loggers[logger_name]
    return process
