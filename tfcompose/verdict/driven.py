"""What there is to say of a sensor's driver: what its preset expects of it, and the switch that it ignores."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.plan import Driven, Plan
    from tfcompose.verdict.offence import Offence

#: Frames that were sent otherwise than expected, or were not expected.
_OTHERWISE = frozenset({"TF802", "TF803"})


def drives_of(plan: Plan) -> dict[str, tuple[Driven, ...]]:
    """Return the sensors that each node drives, by its full name."""
    return {node: process.drives for process in plan.processes for node in process.nodes if process.drives}


def sensor_of(offence: Offence, drives: Mapping[str, Sequence[Driven]]) -> Driven | None:
    """Return the sensor that the offender drives; of several the one whose name the frame has."""
    driven = drives.get(offence.nodes[0], ()) if len(offence.nodes) == 1 and not offence.namesake else ()
    named = [one for one in driven if one.sensor in offence.child]
    return next(iter(named or driven), None)


def message_of(offence: Offence, more: str, driven: Driven | None) -> str:
    """Return the message for frames that a driver sends otherwise than its preset says, or nothing."""
    if driven is None or not driven.publishes or offence.code not in _OTHERWISE or not _is_own(offence):
        return ""
    expected = offence.edge.name if offence.edge else f"no frame {offence.child}"
    return f"preset {driven.preset} expects {expected}, the driver {offence.who} sent {offence.name}{more}"


def advice_of(offence: Offence, driven: Driven | None) -> str:
    """Return what to do about a driver, or nothing."""
    if driven is None or offence.code not in {*_OTHERWISE, "TF801"}:
        return ""
    if driven.publishes and offence.code in _OTHERWISE and _is_own(offence):
        frames = f"frames: {{{offence.child}: {{parent: {offence.parent}}}}}"
        return f"let sensors.{driven.sensor} say what its driver does: " + (
            frames if offence.edge else "options with that frame"
        )
    switch = ", ".join(f"{name}: {json.dumps(value)}" for name, value in driven.switch.items())
    said = f"{offence.whom} drives {driven.sensor} ({driven.preset}) and ignores its switch: start it with {switch}"
    return said if switch else ""


def _is_own(offence: Offence) -> bool:
    """Whether the edge is the offender's own by the plan, or nobody's."""
    return offence.edge is None or offence.edge.node in offence.nodes
