"""The ROS setup: whether TF is published, and whether this process can receive it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import list_names, plural
from tfcompose.model.plan.topics import namespace_options
from tfcompose.tf.ros.environment import DOMAIN, RANGE, RMW
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.tf.live.state import RosProcess, TreeState

LOCALHOST_ONLY, SERVER = "ROS_LOCALHOST_ONLY", "ROS_DISCOVERY_SERVER"
#: Variables that decide which nodes discover each other.
VARIABLES = (DOMAIN, RANGE, LOCALHOST_ONLY, RMW, "ROS_STATIC_PEERS", SERVER)
#: Default values of these variables; empty if the installation decides.
DEFAULTS = {DOMAIN: "0", RANGE: "SUBNET", LOCALHOST_ONLY: "0", RMW: "", SERVER: ""}
#: Maximum number of differing settings in a finding, and of processes with each setting.
MOST_SETTINGS = MOST_PROCESSES = 3


def settings_text(settings: Mapping[str, str]) -> str:
    """Return the settings as text."""
    settings_shown = [f"{name}={settings[name]}" for name in VARIABLES if settings.get(name)]
    if not settings.get(DOMAIN):
        settings_shown.insert(0, f"{DOMAIN} unset (0)")
    return ", ".join(settings_shown)


def elsewhere_help(elsewhere: Sequence[str]) -> str:
    """Return the help for missing TF, which depends on TF on other topics."""
    if elsewhere:
        return f"TF is on {list_names(elsewhere)}: {namespace_options(elsewhere)}"
    return "is the robot running, and with these settings? tfcompose doctor looks for the reason"


def no_tf(state: TreeState) -> Iterator[Finding]:
    """No node publishes TF here."""
    if state.publishers or state.edges or state.malformed:
        return
    moving, fixed = state.topics
    other_nodes = plural(len(state.nodes), "other node") if state.nodes else "no other node"
    message = f"no node publishes {moving} or {fixed}; in {state.seconds:.1f} s {other_nodes} "
    message += "was found" if len(state.nodes) < 2 else "were found"  # noqa: PLR2004 (one, or none)
    notes = [Note(f"seen: {list_names(state.nodes)}")] if state.nodes else []
    notes.append(Note(f"settings: {settings_text(state.settings)}"))
    if state.plan:
        notes.append(
            Note(f"{plural(len(state.plan.edges), 'edge')} of {state.plan.robot} should be there")
        )
    elsewhere = _elsewhere(state)
    if elsewhere:
        notes.append(Note(f"TF is on {list_names(elsewhere)}"))
        advice = f"look there: tfcompose doctor {namespace_options(elsewhere)}"
    elif state.plan and not state.nodes:
        advice = (
            f"is {state.plan.robot} running, and with these settings? tfcompose ps lists the"
            " running robots"
        )
    elif state.nodes:
        advice = (
            "start robot_state_publisher or tfcompose up; tfcompose doctor --for 20 listens longer"
        )
    else:
        advice = (
            "is the robot running, and with these settings? On another machine: are both in one"
            " network with multicast?"
        )
    yield finding("TF845", message, None, notes=notes, help=advice)


def other_settings(state: TreeState) -> Iterator[Finding]:
    """Frames are missing, and local processes with another ROS setup may publish them."""
    complete = not state.planned - {edge.child for edge in state.edges}
    if (state.edges and complete) or (not state.edges and _elsewhere(state)):
        return
    by_settings: dict[tuple[tuple[str, str], ...], list[RosProcess]] = {}
    for process in state.processes:
        apart = settings_apart(process.settings, state.settings)
        if apart:
            by_settings.setdefault(tuple(apart.items()), []).append(process)
    # Processes in this domain first, because they belong to this robot. Then the newest, because
    # users usually look for a robot that they have just started.
    order = sorted(
        by_settings.items(),
        key=lambda item: (DOMAIN in dict(item[0]), -max(process.pid for process in item[1])),
    )
    for apart_items, processes in order[:MOST_SETTINGS]:
        number = "a ROS process" if len(processes) == 1 else f"{len(processes)} ROS processes"
        settings = [f"{name}={value}" for name, value in apart_items]
        here = [
            f"{name} is {state.settings.get(name) or DEFAULTS[name] or 'unset'}"
            for name, _ in apart_items
        ]
        message = (
            f"{number} on this machine cannot be reached from here: started with"
            f" {', '.join(settings)}, "
        )
        message += f"and here {' and '.join(here)}"
        notes = [
            Note(f"pid {process.pid}: {process.command}") for process in processes[:MOST_PROCESSES]
        ]
        more = len(processes) - len(notes)
        notes += [Note(f"and {more} more")] if more else []
        advice = (
            f"to look there: {' '.join(settings)} tfcompose doctor; processes that communicate"
            " need the same settings"
        )
        yield finding("TF908", message, None, severity="warning", notes=notes, help=advice)


def _elsewhere(state: TreeState) -> list[str]:
    """Return the topics with TF that are not observed."""
    return [
        topic.name
        for topic in state.topics_of_type(TF_MESSAGE)
        if topic.publishers and topic.name not in state.topics
    ]


def settings_contradict(state: TreeState) -> Iterator[Finding]:
    """Environment variables of ROS are invalid or contradict each other."""
    settings = state.settings
    value = settings.get(RANGE, "")
    if settings.get(LOCALHOST_ONLY) == "1":
        if value not in {"", "LOCALHOST"}:
            message = (
                f"{LOCALHOST_ONLY}=1 is set, so {RANGE}={value} has no effect: other machines are"
                " not reached"
            )
            yield finding(
                "TF909",
                message,
                None,
                severity="warning",
                help=f"unset {LOCALHOST_ONLY}; it is deprecated",
            )
    elif value not in {"", "SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"}:
        message = f"{RANGE}={value} is not one of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT"
        yield finding(
            "TF909",
            message,
            None,
            severity="warning",
            help="ROS takes SUBNET instead, with a warning",
        )
    elif value == "OFF":
        message = f"{RANGE}=OFF: nodes discover no other node, not even on this machine"
        yield finding(
            "TF909",
            message,
            None,
            help=f"export {RANGE}=LOCALHOST, or SUBNET for several machines",
        )


def settings_apart(theirs: Mapping[str, str], ours: Mapping[str, str]) -> dict[str, str]:
    """Return the settings that prevent processes on this machine from discovering each other."""
    apart = {}
    for name, default in DEFAULTS.items():
        their, our = theirs.get(name) or default, ours.get(name) or default
        if their == our or name == LOCALHOST_ONLY or (name == RANGE and "OFF" not in {their, our}):
            continue
        if name == RMW and not (their and our):
            continue  # the installation's default, which may be equal
        apart[name] = their
    return apart
