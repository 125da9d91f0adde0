"""Settings of all programs that become settings of the robot: clock, namespace and domain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.processes import FILE_KEY
from tfcompose.model.robot import BUILT_IN
from tfcompose.tools.importers.texts import argument_of, concatenate
from tfcompose.tools.importers.yaml_text import ExpressionText

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.tools.importers.draft import ImportDraft

_TF = ("/tf", "/tf_static")
#: Environment variables that are settings of all processes.
_SETTINGS = {"ROS_DOMAIN_ID": "domain_id", "ROS_AUTOMATIC_DISCOVERY_RANGE": "discovery"}
#: Advice for a source with several robots.
SEVERAL = "several robots are parts, each with its namespace, or a fleet: import each on its own"


def one_clock(draft: ImportDraft) -> None:
    """Set the robot's clock from the nodes' use_sim_time.

    All nodes that set use_sim_time must set it to true or to the same argument. Values in
    parameter files count too.
    """
    clocks = [clock for _, clock, _ in draft.clocks if clock is not None]
    arguments = {argument_of(clock) for clock in clocks}
    if clocks and all(clock is True for clock in clocks):
        draft.sections["ros"]["clock"] = "sim"
        _without_clock(draft)
    elif len(arguments) == 1 and (argument := arguments.pop()):
        draft.sections["ros"]["clock"] = ExpressionText(
            f"'sim' if args.{argument.name} else 'wall'"
        )
    if "clock" in draft.sections["ros"]:
        _name_clockless(draft)


def _without_clock(draft: ImportDraft) -> None:
    """Remove use_sim_time from nodes, unless a parameter file also sets it."""
    for keys in draft.started_entries().values():
        params = keys.get("params", {})
        if FILE_KEY not in params and params.pop("use_sim_time", None) and not params:
            del keys["params"]


def _name_clockless(draft: ImportDraft) -> None:
    """Note the nodes that set no clock in the source, because they now get the robot's clock."""
    nodes = {
        name: span
        for name, clock, span in draft.clocks
        if clock is None and _takes_settings(draft.started_entries()[name].get("run", {}))
    }
    if nodes:
        message = f"the source sets no use_sim_time for {', '.join(nodes)}: here they have"
        draft.todo(f"{message} the robot's clock", next(iter(nodes.values())))


def _takes_settings(run: Any) -> bool:
    """Return whether tfcompose passes the robot's settings to a process as ROS arguments."""
    return isinstance(run, dict) and "launch" not in run


def is_setting(draft: ImportDraft, name: str, value: str) -> bool:
    """If a variable is a setting of the whole robot, set it on the robot and return True.

    If the source sets several values, the first value wins.
    """
    if name not in _SETTINGS:
        return False
    settings = {"domain_id": int(value) if value.isdecimal() else None, "discovery": value.lower()}
    setting = settings[_SETTINGS[name]]
    allowed = (
        setting in {"localhost", "subnet", "off"}
        if name != "ROS_DOMAIN_ID"
        else setting is not None
    )
    return allowed and draft.sections["ros"].setdefault(_SETTINGS[name], setting) == setting


def is_isolated(draft: ImportDraft, moved: Mapping[str, str], namespace: str | None) -> bool:
    """Return whether remappings keep TF on its topics or move it below the draft's namespace."""
    new = {topic: moved[topic] for topic in _TF if moved.get(topic, topic) != topic}
    if any(name != topic.strip("/") for topic, name in new.items()):
        return False
    space = (namespace or "").strip("/")
    if not new or not space:
        return True
    if draft.sections["ros"].setdefault("namespace", space) != space:
        return False
    draft.sections["ros"]["isolate"] = "topics"
    return True


def one_namespace(draft: ImportDraft) -> None:
    """Make namespaces below the robot's namespace relative, and all others absolute."""
    ros = draft.sections["ros"]
    space = ros.get("namespace")
    if not space:
        return
    for name, keys in draft.started_entries().items():
        if name in BUILT_IN:
            continue
        namespace = keys.pop("namespace", "")
        if not namespace and not isinstance(keys.get("run", {}), dict):
            continue  # tfcompose passes no namespace to a command
        if namespace.startswith(f"{space}/"):
            keys["namespace"] = namespace[len(space) + 1 :]
        elif namespace != space:
            keys["namespace"] = concatenate(["/", namespace])
            if ros.get("isolate"):
                message = f"{name} is not in {space}: its /tf is the robot's, {space}/tf"
                draft.todo(message, None, draft.entry_of(name), SEVERAL)
