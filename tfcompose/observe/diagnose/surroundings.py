"""Whether there is anything to listen to, and whether this process can hear it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.observe.elsewhere import namespace_words, said
from tfcompose.observe.seen import counted, listed
from tfcompose.ros.environment import DOMAIN, RANGE, RMW
from tfcompose.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.observe.seen import RosProcess, Seen

LOCALHOST_ONLY, SERVER = "ROS_LOCALHOST_ONLY", "ROS_DISCOVERY_SERVER"
#: What decides who hears whom, with what holds where it is not set.
DEFAULTS = {DOMAIN: "0", RANGE: "SUBNET", LOCALHOST_ONLY: "0", RMW: "", SERVER: ""}
#: Of processes with other settings, those of so many settings are named, so many of each.
MOST_SETTINGS = MOST_PROCESSES = 3


def no_tf(seen: Seen) -> Iterator[Finding]:
    """Nobody publishes TF here."""
    if seen.publishers or seen.edges or seen.malformed:
        return
    moving, fixed = seen.topics
    others = counted(len(seen.nodes), "other node") if seen.nodes else "no other node"
    message = f"nobody publishes {moving} or {fixed}; in {seen.seconds:.1f} s {others} "
    message += "was seen" if len(seen.nodes) < 2 else "were seen"  # noqa: PLR2004 (one, or none)
    notes = [Note(f"seen: {listed(seen.nodes)}")] if seen.nodes else []
    notes.append(Note(f"looked with {said(seen.settings)}"))
    if seen.plan:
        notes.append(Note(f"{counted(len(seen.plan.edges), 'edge')} of {seen.plan.robot} should be there"))
    elsewhere = _elsewhere(seen)
    if elsewhere:
        notes.append(Note(f"there is TF on {listed(elsewhere)}"))
        advice = f"look there: tfcompose doctor {namespace_words(elsewhere)}"
    elif seen.plan and not seen.nodes:
        advice = f"is {seen.plan.robot} up, and with these settings? tfcompose ps says which robots run"
    elif seen.nodes:
        advice = "start robot_state_publisher, or tfcompose up; tfcompose doctor --for 20 looks longer"
    else:
        advice = (
            "is the robot running, and with these settings? On another machine: are both in one network with multicast?"
        )
    yield finding("TF845", message, None, notes=notes, help=advice)


def other_settings(seen: Seen) -> Iterator[Finding]:
    """Where frames are missing: processes of this machine that cannot be heard, because ROS is set up otherwise."""
    complete = not seen.planned - {edge.strand.child for edge in seen.edges}
    if (seen.edges and complete) or (not seen.edges and _elsewhere(seen)):
        return
    found: dict[tuple[tuple[str, str], ...], list[RosProcess]] = {}
    for process in seen.processes:
        apart = differences(process.settings, seen.settings)
        if apart:
            found.setdefault(tuple(apart.items()), []).append(process)
    # Those of this domain first: they are of this robot. Else who was started last, as robots are that one looks for.
    order = sorted(found.items(), key=lambda item: (DOMAIN in dict(item[0]), -max(one.pid for one in item[1])))
    for apart_items, processes in order[:MOST_SETTINGS]:
        number = "a ROS process" if len(processes) == 1 else f"{len(processes)} ROS processes"
        settings = [f"{name}={value}" for name, value in apart_items]
        here = [f"{name} is {seen.settings.get(name) or DEFAULTS[name] or 'unset'}" for name, _ in apart_items]
        message = f"{number} on this machine cannot be heard from here: started with {', '.join(settings)}, "
        message += f"and here {' and '.join(here)}"
        notes = [Note(f"pid {one.pid}: {one.command}") for one in processes[:MOST_PROCESSES]]
        more = len(processes) - len(notes)
        notes += [Note(f"and {more} more")] if more else []
        advice = (
            f"to look there: {' '.join(settings)} tfcompose doctor; who is to hear each other needs the same settings"
        )
        yield finding("TF908", message, None, severity="warning", notes=notes, help=advice)


def _elsewhere(seen: Seen) -> list[str]:
    """Return the topics with TF that are not looked at."""
    return [topic.name for topic in seen.typed(TF_MESSAGE) if topic.publishers and topic.name not in seen.topics]


def settings_contradict(seen: Seen) -> Iterator[Finding]:
    """Variables that set up ROS say what cannot be, or contradict each other."""
    settings = seen.settings
    value = settings.get(RANGE, "")
    if settings.get(LOCALHOST_ONLY) == "1":
        if value not in {"", "LOCALHOST"}:
            message = f"{LOCALHOST_ONLY}=1 is set, so {RANGE}={value} does not count: other machines are not heard"
            yield finding("TF909", message, None, severity="warning", help=f"unset {LOCALHOST_ONLY}; it is out of use")
    elif value not in {"", "SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"}:
        message = f"{RANGE}={value} is none of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT"
        yield finding("TF909", message, None, severity="warning", help="ROS takes SUBNET instead, with a warning")
    elif value == "OFF":
        message = f"{RANGE}=OFF: nobody is discovered, on this machine neither"
        yield finding("TF909", message, None, help=f"export {RANGE}=LOCALHOST, or SUBNET for several machines")


def differences(theirs: Mapping[str, str], ours: Mapping[str, str]) -> dict[str, str]:
    """Return with which of their settings processes on one machine do not hear each other; none if nothing says so."""
    apart = {}
    for name, default in DEFAULTS.items():
        their, our = theirs.get(name) or default, ours.get(name) or default
        if their == our or name == LOCALHOST_ONLY or (name == RANGE and "OFF" not in {their, our}):
            continue
        if name == RMW and not (their and our):
            continue  # the installation's default, which may be the same
        apart[name] = their
    return apart
