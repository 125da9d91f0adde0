"""Isolation of robots: frame prefixes, topics below a namespace, and names of processes.

A prefix is prepended unchanged to the name of every frame that robots do not share, like
robot_state_publisher's ``frame_prefix``. Topics are isolated as in Clearpath's software. /tf and
/tf_static are absolute names, so a namespace does not move them. Remappings move them below the
namespace for all processes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.hosts import entry_of
from tfcompose.compiler.resolve.processes import full_name
from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.model.fields import narrow
from tfcompose.model.plan import RosSettings, is_known_at_launch
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.spec.language.variables import CALLS
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.model.robot import Node, Process, Robot
    from tfcompose.spec.language.robot import RobotSpec, RosSpec
    from tfcompose.spec.load import Path


def settings_of(ros: RosSpec) -> RosSettings:
    """Return the settings of all processes, with the frame prefix that ``isolate`` implies."""
    namespace = ros.namespace.strip("/")
    prefix = ros.frame_prefix
    if not prefix and ros.isolate in {"frames", "both"} and namespace:
        prefix = f"{namespace}/"
    return narrow(RosSettings, ros, namespace=namespace, frame_prefix=prefix)


def topics_below(namespace: str, isolate: str) -> dict[str, str]:
    """Return the remappings of the TF topics.

    The topics are moved below ``namespace`` if topics are isolated and it is not empty.
    """
    moves = isolate in {"topics", "both"} and namespace
    return {topic: f"/{namespace}{topic}" for topic in GLOBAL} if moves else {}


def isolate(draft: Draft) -> Iterator[Finding]:
    """Remap the topics of all processes, and insert the frames and files that processes name."""
    robot, spec = draft.robot, draft.spec
    yield from _faults(robot, spec)
    remap = topics_below(robot.ros.namespace, spec.ros.isolate)
    arguments = draft.validated.inputs.ros
    rules = arguments.remap
    owners = {edge.owner for edge in robot.edges}
    processes = []
    filler = _ProcessFiller(draft)
    for process in robot.processes:
        moved = replace(process, remap=remap | process.remap)
        owns = process.name in owners
        if rules:
            moved = _remapped(moved, rules, robot.ros.namespace, owns=owns)
        if arguments.level and process.is_node(owns=owns):
            moved = moved.with_default_level(arguments.level)
        processes.append(filler.fill(moved))
    yield from filler.findings
    draft.robot = replace(robot, processes=tuple(processes))


def _remapped(
    process: Process, rules: Mapping[str, str], robot_namespace: str, *, owns: bool
) -> Process:
    """Return the process with remapping ``rules``, which take precedence over its own rules.

    Rules for TF topics apply to every process. Other rules apply only to ROS nodes.
    """
    namespace = robot_namespace if process.namespace is None else process.namespace
    names = {old: full_name(namespace, old) for old in rules}
    # Nodes that observe TF use the full names of its topics.
    rules_of_tf = {
        names[old]: full_name(robot_namespace, new)
        for old, new in rules.items()
        if names[old] in GLOBAL
    }
    local_rules = {old: new for old, new in rules.items() if names[old] not in GLOBAL}
    outer = rules_of_tf | (local_rules if process.is_node(owns=owns) else {})
    remap = outer | {old: new for old, new in process.remap.items() if old not in outer}
    ready = process.ready
    if ready and ready.kind == "topic":
        moved = {names[old]: full_name(namespace, new) for old, new in local_rules.items()}
        ready = replace(ready, text=moved.get(ready.text, ready.text))
    return replace(process, remap=remap, ready=ready)


def _faults(robot: Robot, spec: RobotSpec) -> Iterator[Finding]:
    ros = spec.ros
    has_parts = spec.parts or any(section == "parts" for section, _ in robot.broken)
    named = robot.ros.namespace or has_parts or (ros.isolate == "frames" and ros.frame_prefix)
    if ros.isolate != "none" and not named:
        message = f"isolate: {ros.isolate} needs a namespace"
        advice = "ros: {namespace: robot1}"
        yield finding("TF304", message, spec.span_of(("ros", "isolate")), help=advice)
    for index, frame in enumerate(ros.shared_frames):
        if frame not in robot.frames and not robot.tolerates(frame):
            message = f"shared_frames: unknown frame {frame}"
            advice = did_you_mean(frame, robot.frames, "remove it")
            span = spec.span_of(("ros", "shared_frames", index))
            yield finding("TF203", message, span, help=advice)


@dataclass(slots=True)
class _ProcessFiller:
    """Inserts the frames and files that processes name."""

    draft: Draft
    #: Findings about names that cannot be inserted.
    findings: list[Finding] = field(default_factory=list)

    def fill(self, process: Process) -> Process:
        """Return the process with every ``${frame(NAME)}`` and ``${file(PATH)}`` replaced."""
        section = entry_of(process, self.draft.spec)
        done = replace(
            process,
            ros_nodes=tuple(
                replace(n, params=self._fill(n.params, (*n.path, "params")))
                for n in process.ros_nodes
            ),
            all_nodes=process.all_nodes
            and replace(
                process.all_nodes,
                params=self._fill(process.all_nodes.params, (*section, "params")),
            ),
            argv=self._fill(process.argv, (*section, "run")),
            remap=self._fill(process.remap, (*section, "remap")),
            env=self._fill(process.env, (*section, "env")),
            cwd=self._folder(process.cwd, (*section, "cwd")),
        )
        for node in done.ros_nodes:
            self._check_paths(done, node)
        return done

    def _fill(self, value: Any, path: Path) -> Any:
        if isinstance(value, str):
            return (
                CALLS.sub(lambda call: self._replacement_for(call[1], call[2], path), value)
                if "${" in value
                else value
            )
        if isinstance(value, dict):
            return {key: self._fill(item, (*path, key)) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return type(value)(
                self._fill(item, (*path, index)) for index, item in enumerate(value)
            )
        return value

    def _replacement_for(self, what: str, name: str, path: Path) -> str:
        return self._frame(name, path) if what == "frame" else self._file(name, path)

    def _frame(self, frame: str, path: Path) -> str:
        if frame not in self.draft.robot.frames and not self.draft.robot.tolerates(frame):
            advice = did_you_mean(frame, self.draft.robot.frames)
            span = self.draft.spec.span_of(path)
            self.findings.append(
                finding("TF203", f"${{frame({frame})}}: unknown frame {frame}", span, help=advice)
            )
        return self.draft.robot.final(frame)

    def _file(self, name: str, path: Path) -> str:
        span = self.draft.spec.span_of(path)
        place = find_path(name, span)
        if name.startswith("/"):
            advice = (
                "a path from this file's folder; or write the path alone, which no other"
                " machine has"
            )
            self.findings.append(
                finding("TF106", f"${{file({name})}} is an absolute path", span, help=advice)
            )
        elif self.draft.disk and not (
            self.draft.disk.is_file(place) or self.draft.disk.is_folder(place)
        ):
            message = f"${{file({name})}}: {place} does not exist"
            self.findings.append(
                finding(
                    "TF019",
                    message,
                    span,
                    help="paths are relative to the file that contains them",
                )
            )
        return f"${{file:{place}}}"

    def _folder(self, cwd: str | None, path: Path) -> str | None:
        """Return the working directory of a process.

        A relative path starts at the folder of the file that contains it.
        """
        if cwd is None or cwd.startswith(("/", "${")):
            return self._fill(cwd, path)  # type: ignore[no-any-return]
        span = self.draft.spec.span_of(path)
        place = find_path(cwd, span)
        if self.draft.disk and not self.draft.disk.is_folder(place):
            advice = "paths are relative to the file that contains them"
            self.findings.append(
                finding("TF019", f"cwd: the folder {place} does not exist", span, help=advice)
            )
        return f"${{file:{place}}}"

    def _check_paths(self, process: Process, node: Node) -> None:
        """Report parameters with paths known only at launch time, if the launcher cannot set them.

        The launcher can set a parameter of a component, or of a package's program with a single
        node.
        """
        can = process.component or (
            process.kind == "run" and process.package is not None and len(process.nodes) == 1
        )
        for key, value in node.params.items() if not can else ():
            if is_known_at_launch(value):
                message = (
                    f"the parameter {key} of {process.name} contains a path that is known only at"
                    " the start"
                )
                advice = "write it among the arguments of run"
                span = self.draft.spec.span_of((*node.path, "params", key))
                self.findings.append(finding("TF816", message, span, help=advice))
