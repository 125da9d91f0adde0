"""tfcompose's own processes, and what may be said of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.model import BUILT_IN, GUARD, JOINTS, STATIC, Node, Process
from tfcompose.resolve.nodes import full_name

if TYPE_CHECKING:
    from tfcompose.language.process import ProcessSpec
    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source
    from tfcompose.plan import ProcessKind

_BUILT_IN_KEYS = frozenset({"rate", "remap", "env", "host", "after"})
#: The parameters of ``joints``: robot_state_publisher's, where it has them, each with an example.
_JOINTS_PARAMS: dict[str, Any] = {"publish_frequency": 30.0, "ignore_timestamp": True}
_KINDS: dict[str, ProcessKind] = {STATIC: "static", JOINTS: "joints", GUARD: "guard"}


def built_in(spec: RobotSpec, source: Source) -> list[Process]:
    """Return tfcompose's own processes, with what stands of them under ``processes``."""
    own = []
    for name in BUILT_IN:
        said = spec.processes.get(name)
        at = source.at_key(("processes", name)) if said else source.at_key(("robot",))
        path: Path = ("processes", name)
        params = said.params if said and name == JOINTS else {}
        node = Node(full_name(spec.ros.namespace, f"tfcompose_{name}"), at, path, params)
        process = Process(name, _KINDS[name], at, (node,))
        if said:
            given = {key: getattr(said, key) for key in _BUILT_IN_KEYS}
            process = replace(process, **given)
        own.append(process)
    return own


def built_in_keys(name: str, said: ProcessSpec, source: Source) -> list[Finding]:
    """Return findings about what stands under the name of one of tfcompose's own processes."""
    at: Path = ("processes", name)
    known = _BUILT_IN_KEYS | ({"params"} if name == JOINTS else set())
    wrong = said.model_fields_set - known
    advice = f"its keys can be: {', '.join(sorted(known))}"
    found = [
        finding("TF101", f"{name} is built in and has no {key}", source.at_key((*at, key)), help=advice)
        for key in wrong
    ]
    return found + (_joints_params(said.params, source) if name == JOINTS else [])


def _joints_params(params: dict[str, Any], source: Source) -> list[Finding]:
    """Return findings about the parameters of ``joints``."""
    found = []
    for name, value in params.items():
        at: Path = ("processes", JOINTS, "params", name)
        example = _JOINTS_PARAMS.get(name)
        if example is None:
            advice = did_you_mean(name, _JOINTS_PARAMS, f"it has {' and '.join(_JOINTS_PARAMS)}")
            found.append(finding("TF101", f"joints has no parameter {name}", source.at_key(at), help=advice))
        elif isinstance(value, bool) != isinstance(example, bool) or not isinstance(value, (bool, int, float)):
            advice = f"for example {name}: {str(example).lower()}"
            what = "true or false" if isinstance(example, bool) else "a number of hertz"
            found.append(finding("TF103", f"{name} is {what}", source.at(at), help=advice))
        elif not isinstance(value, bool) and not 0 < value < math.inf:
            advice = "leave it out, and every joint state is published"
            found.append(finding("TF106", f"{name} has to be above 0", source.at(at), help=advice))
    return found
