"""Whether there is anything to listen to, and whether this process can hear it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, finding
from tfcompose.observe.diagnose.senders import TF_TYPE
from tfcompose.observe.seen import counted, listed
from tfcompose.ros.settings import DOMAIN, RMW

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.observe.seen import RosProcess, Seen

RANGE, LOCALHOST_ONLY = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
#: What decides who hears whom, with what holds where it is not set.
DEFAULTS = {DOMAIN: "0", RANGE: "SUBNET", LOCALHOST_ONLY: "0", RMW: ""}
VARIABLES = (*DEFAULTS, "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")


def no_tf(seen: Seen) -> Iterator[Diagnostic]:
    """Nobody publishes TF here."""
    if seen.publishers or seen.edges:
        return
    moving, fixed = seen.topics
    others = counted(len(seen.nodes), "other node") if seen.nodes else "no other node"
    message = f"nobody publishes {moving} or {fixed}; in {seen.seconds:.1f} s {others} "
    message += "was seen" if len(seen.nodes) < 2 else "were seen"  # noqa: PLR2004 (one, or none)
    notes = [Note(f"seen: {listed(seen.nodes)}")] if seen.nodes else []
    notes.append(Note(f"looked with {said(seen.settings)}"))
    elsewhere = [t.name for t in seen.typed(TF_TYPE) if t.publishers and t.name not in seen.topics]
    namespaces = list(dict.fromkeys(name.rpartition("/")[0] for name in elsewhere))
    if elsewhere:
        notes.append(Note(f"there is TF on {listed(elsewhere)}"))
        words = [f"--namespace {name}" if name else "without --namespace" for name in namespaces]
        advice = f"look there: tfcompose doctor {' or '.join(words)}"
    elif seen.nodes:
        advice = "start robot_state_publisher, or tfcompose up; tfcompose doctor --for 20 looks longer"
    else:
        advice = (
            "is the robot running, and with these settings? On another machine: are both in one network with multicast?"
        )
    yield finding("TF845", message, None, notes=notes, help=advice)


def other_settings(seen: Seen) -> Iterator[Diagnostic]:
    """Where frames are missing: processes of this machine that cannot be heard, because ROS is set up otherwise."""
    if seen.edges and not seen.planned - {edge.strand.child for edge in seen.edges}:
        return
    found: dict[str, list[RosProcess]] = {}
    for process in seen.processes:
        apart = differences(process.settings, seen.settings)
        if apart:
            found.setdefault(apart, []).append(process)
    for apart, processes in found.items():
        number = "a ROS process" if len(processes) == 1 else f"{len(processes)} ROS processes"
        message = f"{number} on this machine cannot be heard from here: started with {apart}"
        notes = [Note(f"pid {one.pid}: {one.command}") for one in processes[:6]]
        more = len(processes) - len(notes)
        notes += [Note(f"and {more} more")] if more else []
        advice = "start both with the same settings; a shell's own: env | grep -E '^(ROS|RMW)_'"
        yield finding("TF908", message, None, severity="warning", notes=notes, help=advice)


def settings_contradict(seen: Seen) -> Iterator[Diagnostic]:
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


def differences(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Return why processes with these settings on one machine do not hear each other; empty if nothing says so."""
    parts = []
    for name, default in DEFAULTS.items():
        their, our = theirs.get(name) or default, ours.get(name) or default
        if their == our or name == LOCALHOST_ONLY or (name == RANGE and "OFF" not in {their, our}):
            continue
        if name == RMW and not (their and our):
            continue  # the installation's default, which may be the same
        parts.append(f"{name}={their}, and here it is {our}")
    return ", ".join(parts)


def said(settings: Mapping[str, str]) -> str:
    """Return the settings as people read them."""
    words = [f"{name}={settings[name]}" for name in VARIABLES if settings.get(name)]
    if DOMAIN not in settings:
        words.insert(0, f"{DOMAIN} unset (0)")
    return ", ".join(words)
