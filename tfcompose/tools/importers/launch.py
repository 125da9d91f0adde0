"""Import of launch files into the draft of a robot file.

A separate process reads a launch file and returns records. This module turns the records into
entries of the robot file.
"""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.compiler.resolve.containers import PROGRAMS
from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.numbers import number
from tfcompose.foundation.yaml_text import Bare
from tfcompose.model.plan.stock import STATE_PUBLISHER
from tfcompose.model.process_keys import (
    EXTRA_ARGUMENTS,
    PROCESS_KEYS,
    Folder,
    Seconds,
)
from tfcompose.model.robot import value_of_word
from tfcompose.tools.importers.draft import path_from, where
from tfcompose.tools.importers.executables import add_program
from tfcompose.tools.importers.launch_answer import Launch, answer_of, has_launch, reach_of
from tfcompose.tools.importers.launch_records import PACKAGE, relative, scalar_of
from tfcompose.tools.importers.launch_ros1 import has_only_transforms, is_of_ros1
from tfcompose.tools.importers.program import (
    CONTAINERS,
    JOINT_PUBLISHERS,
    Description,
    Program,
)
from tfcompose.tools.importers.robot_settings import (
    SEVERAL,
    is_isolated,
    is_setting,
    one_clock,
    one_namespace,
)
from tfcompose.tools.importers.static_transforms import PLUGIN as STATIC_PLUGIN
from tfcompose.tools.importers.static_transforms import PROGRAM, static_words
from tfcompose.tools.importers.texts import (
    FileText,
    Text,
    arguments_in,
    files_in,
    fill,
)
from tfcompose.tools.importers.yaml_text import ExpressionText

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.model.files import Target
    from tfcompose.tools.importers.draft import ImportDraft

#: Programs whose arguments become values in the robot file.
_READ = frozenset({PROGRAM, STATE_PUBLISHER, *JOINT_PUBLISHERS})
_ADVICE = "--package NAME=FOLDER, or source the workspace's setup file"
_INSTALL = (
    "source a distribution's setup file, such as /opt/ros/jazzy/setup.bash: launch comes with it"
    " (apt install ros-jazzy-ros-base), and not with pip"
)
#: Programs that also exist as components, by class.
_PUBLISHERS = {
    STATIC_PLUGIN: PROGRAM,
    "robot_state_publisher::RobotStatePublisher": STATE_PUBLISHER,
}


def add_launch(draft: ImportDraft, launch: Launch, target: Target) -> list[Description]:
    """Add the processes of a launch file to the draft.

    Return the descriptions of its robot_state_publishers.

    Raises:
        RejectedError: if the file is not a launch file, takes too much time or memory, or needs
        ROS's launch and this is not installed.
    """
    draft.reach = reach_of(launch)
    of_ros1 = is_of_ros1(launch.text, launch.file)
    of_launch = not of_ros1 and has_launch()
    if not of_ros1 and not of_launch and not has_only_transforms(launch.text, launch.file):
        message = "ROS's launch, which reads launch files of ROS 2, is not installed"
        raise RejectedError([finding("TF901", message, launch.span(), help=_INSTALL)])
    draft.head[-1] += ", a launch file of ROS 1" if of_ros1 else ""
    draft.head[-1] += ", read by ROS's launch" if of_launch else ""
    answer = answer_of(launch, draft.reach, "launch" if of_launch else "xml")
    draft.made |= answer["files"]
    work = _LaunchImport(draft, launch, target, answer["records"])
    for record in answer["records"]:
        work.add(record)
    work.finish(answer["decided"])
    if answer["stopped"]:
        span = launch.span(answer["line"])
        if not any(
            record["kind"] not in {"package", "todo", "argument", "file"}
            for record in answer["records"]
        ):
            raise RejectedError([finding("TF002", answer["stopped"], span), *draft.findings])
        draft.todo(f"the launch file was read only in part: {answer['stopped']}", span)
    return work.descriptions


class _LaunchImport:
    """Turns the records of a launch file into entries of the draft."""

    def __init__(
        self, draft: ImportDraft, launch: Launch, target: Target, records: list[dict[str, Any]]
    ) -> None:
        self.draft, self.launch, self.target = draft, launch, target
        self.descriptions: list[Description] = []
        self._names: dict[str, str] = {}
        self._after: list[tuple[str, dict[str, str]]] = []
        self._delays: list[tuple[str, float]] = []
        self._missing: dict[str, Span] = {}
        self._saved: dict[str, Span] = {}
        #: The containers of components, by the id of their action or the full name of their node.
        self._loading = {
            record["container"] for record in records if record["kind"] == "component"
        }
        self._containers: dict[str, str] = {}
        self._components: list[tuple[str, str, Span]] = []
        self._only_when = ""
        self._arguments: dict[str, tuple[dict[str, Any], Span]] = {}
        #: Arguments whose values are in frames.
        self._read: set[str] = set()

    def add(self, record: dict[str, Any]) -> None:
        """Add the entries for a record."""
        span = self._span(record["at"])
        kind = record["kind"]
        adders: dict[str, Callable[[dict[str, Any], Span], None]] = {
            "node": self._node,
            "process": self._node,
            "container": self._node,
            "component": self._component,
            "include": self._include,
            "argument": self._argument,
            "lifecycle": self._lifecycle,
            "required": self._keep_required,
        }
        if kind in adders:
            adders[kind](record, span)
        elif kind == "file":
            self._saved[record["path"]] = self._span(record["at"])
        elif kind == "package":
            self._missing.setdefault(record["name"], span)
        elif kind == "skipped":
            self.draft.todo(
                f"left out: {record['text']}", span, advice="--all-branches takes it in"
            )
        else:
            self.draft.todo(record["text"], span)

    def finish(self, decided: list[str]) -> None:
        """Add the entries that depend on all records.

        ``decided`` are the arguments whose values are fixed in the entries.
        """
        one_clock(self.draft)
        self._args({*decided, *self._read})
        self._into_containers()
        started = self.draft.started_entries()
        for name, after in self._after:
            container = started[name].get("container")
            conditions = {
                self._names[key]: what
                for key, what in after.items()
                if self._names.get(key, container) != container
            }
            if conditions:
                started[name].setdefault("after", {}).update(conditions)
        self._delay()
        one_namespace(self.draft)
        for package, span in self._missing.items():
            self.draft.todo(f"package {package} not found", span, advice=_ADVICE)
        for file, span in self._saved.items():
            if file not in self.draft.used:
                self.draft.todo(f"open for writing {file}: not done", span)

    def _span(self, place: Any) -> Span:
        file, line = (place[0], place[1]) if place else ("", 1)
        absolute = str(Path(self.launch.file).absolute())
        if file not in {absolute, ""} and not self.draft.reach.allows(file):
            return self.launch.span()  # the finding shows the lines of this location
        return (
            self.launch.span(line)
            if file in {absolute, ""}
            else Span(os.path.relpath(file), max(line, 1))
        )

    def _argument(self, record: dict[str, Any], span: Span) -> None:
        self._arguments[record["name"]] = (record, span)

    def _args(self, decided: set[str]) -> None:
        """Add the arguments that entries use, and note the values of all other arguments."""
        used = arguments_in(self.draft.sections) | self._in_expressions()
        unread = {
            name: span
            for name, (_, span) in self._arguments.items()
            if name not in used and name not in decided
        }
        if unread:
            named = f"the launch argument{'' if len(unread) == 1 else 's'} {', '.join(unread)}"
            self.draft.todo(f"nothing imported reads {named}", next(iter(unread.values())))
        fixed: dict[str, Span] = {}
        for name, (record, span) in self._arguments.items():
            value, path = record["value"], ("args", name)
            if name in used:
                typed = scalar_of(value)
                kind = {str: "string", float: "float"}.get(type(typed))
                keys: dict[str, Any] = {"type": kind} if kind else {}
                keys |= {"default": typed}
                choices = [scalar_of(choice) for choice in record["choices"]]
                keys |= (
                    {"choices": choices}
                    if choices and {type(choice) for choice in choices} == {type(typed)}
                    else {}
                )
                keys |= (
                    {"description": " ".join(record["description"].split())}
                    if record["description"].strip()
                    else {}
                )
                keys |= {"env": record["variable"]} if record["variable"] else {}
                self.draft.sections["args"][name] = keys
                self.draft.note(path, where(span))
            if name in decided:
                fixed[f"{name}:={relative(value) or repr('')}"] = span
                if name in used:
                    self.draft.note(
                        path,
                        f"where it decides what is started, or is computed with, it is {value!r}",
                    )
        if fixed:
            named = (
                f"{'this launch argument' if len(fixed) == 1 else 'these launch arguments'}:"
                f" {' '.join(fixed)}"
            )
            advice = (
                "import … NAME:=VALUE takes another value, --all-branches what conditions"
                " leave out"
            )
            self.draft.todo(
                f"what is imported holds for {named}", next(iter(fixed.values())), advice=advice
            )

    def _in_expressions(self) -> set[str]:
        texts = [
            keys["when"]
            for entries in self.draft.sections.values()
            for keys in entries.values()
            if isinstance(keys, dict) and "when" in keys
        ]
        texts.append(self.draft.sections["ros"].get("clock", ""))
        return {
            name
            for text in texts
            for name in re.findall(r"\bargs\.([A-Za-z_][A-Za-z0-9_]*)", text)
        }

    def _node(self, record: dict[str, Any], span: Span) -> None:
        program = self._program(record, span)
        self._only_when = record.get("only_when", "")
        if program.executable == STATE_PUBLISHER:
            self._describe(program, span)
            return
        before = set(self.draft.sections["frames"])
        name = add_program(self.draft, program, self.target)
        if name is None:
            for child in self.draft.sections["frames"].keys() - before:
                self._conditions(record, ("frames", child))
            return
        self._keep_started(record, name)
        if program.loads:
            self._containers[str(record["id"])] = self._containers[_full_name(program)] = name

    def _keep_started(self, record: dict[str, Any], name: str) -> None:
        """Store the conditions, the predecessors and the delay of an added process."""
        self._names[str(record.get("id"))] = name
        self._conditions(record, self.draft.entry_of(name))
        if record.get("after"):
            self._after.append((name, record["after"]))
        if record.get("period"):
            self._delays.append((name, record["period"]))

    def _component(self, record: dict[str, Any], span: Span) -> None:
        """Add a node that a container loads.

        If its class is a stock publisher, import it like the publisher's program.
        """
        plugin = record["plugin"]
        if plugin in _PUBLISHERS:
            argv = static_words(record["params"]) if plugin == STATIC_PLUGIN else []
            record = {**record, "executable": _PUBLISHERS[plugin], "argv": argv}
            self._node(record | ({"params": []} if argv else {}), span)
            return
        program = replace(self._program(record, span), plugin=plugin)
        if not program.name:
            unnamed = "the name that its class gives the component: here it differs"
            program = replace(program, todo=(*program.todo, unnamed))
        name = add_program(self.draft, program, self.target) or ""
        self._keep_started(record, name)
        self._components.append((name, record["container"], span))

    def _into_containers(self) -> None:
        """Set the container of each component.

        A container that the launch file does not start becomes an external container.
        """
        for name, container, span in self._components:
            if container not in self._containers:
                namespace, _, node = container.strip("/").rpartition("/")
                free = self.draft.free_name(node)
                keys: dict[str, Any] = {"external": True} | (
                    {"node": node} if node != free else {}
                )
                keys |= {"namespace": namespace} if namespace else {}
                note = where(span, "the source does not start this container: it starts elsewhere")
                self._containers[container] = self.draft.process(
                    free, keys, note, section="containers"
                )
            self.draft.sections["processes"][name]["container"] = self._containers[container]

    def _conditions(self, record: dict[str, Any], path: tuple[str, str]) -> None:
        for text in record.get("when", ()):
            self.draft.note(path, f"only if {text}")
        if record.get("only_when"):
            entry = self.draft.sections[path[0]][path[1]]
            entry["when"] = ExpressionText(record["only_when"])

    def _program(self, record: dict[str, Any], span: Span) -> Program:
        todo: list[str] = []
        params, description = _split_description(record.get("params", []), todo)
        if record["kind"] != "component":
            params = list(map(_as_in_file, params))
        keys = self._keys(record, todo)
        argv = tuple(record.get("argv", ()))
        if record.get("executable") in _READ:
            self._read |= arguments_in(argv)
            argv = tuple(map(str, argv))
        else:
            argv = tuple(_without_texts(argument, todo) for argument in argv)
        reader = None if record["kind"] == "process" else "ros2"
        loads = record["kind"] == "container" or self._is_container(record)
        if record.get("ros1"):
            description = (
                description if record["executable"] == STATE_PUBLISHER else None
            )  # a parameter of all nodes
            reader = "tf" if record["package"] == "tf" else "tf2_ros"
        return Program(
            span,
            record.get("package"),
            record.get("executable"),
            argv=argv,
            shell=bool(record.get("shell")),
            name=record.get("name"),
            label=record.get("label"),
            namespace=record.get("namespace"),
            params=tuple(params),
            exact=_exact(record),
            remap=tuple((old, new) for old, new in record.get("remap", ())),
            env=self._env(record),
            keys=keys,
            period_s=record.get("period", 0.0),
            reader=reader,  # type: ignore[arg-type]
            description=description,
            todo=tuple(todo),
            loads=loads,
        )

    def _is_container(self, record: dict[str, Any]) -> bool:
        """Return whether a node is a container.

        It is if its program is a container, or if an action loads components into it.
        """
        if record["kind"] != "node":
            return False
        stock = {program for program, _ in PROGRAMS.values()}
        is_stock = record["package"] == CONTAINERS and record["executable"] in stock
        named = f"{(record['namespace'] or '').rstrip('/')}/{record['name']}"
        return is_stock or bool({str(record["id"]), named} & self._loading)

    def _env(self, record: dict[str, Any]) -> dict[str, str]:
        """Return the process's environment variables, without settings of the whole robot."""
        return {
            name: value
            for name, value in record.get("env", {}).items()
            if isinstance(value, Text) or not is_setting(self.draft, name, value)
        }

    def _keys(self, record: dict[str, Any], todo: list[str]) -> dict[str, Any]:
        keys: dict[str, Any] = {}
        if record.get("lifecycle"):
            keys["lifecycle"] = record["lifecycle"]
        for row in (*PROCESS_KEYS, EXTRA_ARGUMENTS):
            value = row.launch.read(record, todo) if row.launch else None
            if value is not None:
                keys[row.name] = self._in_language(value)
        if record.get("only_env"):
            todo.append("env replaces the environment in the source; here it adds to it")
        return keys

    def _in_language(self, value: Any) -> Any:
        """Return a value in the form that it has in a robot file."""
        if isinstance(value, dict):
            return {name: self._in_language(item) for name, item in value.items()}
        if isinstance(value, Folder):
            return path_from(self.target, value)
        return _seconds(value) if isinstance(value, Seconds) else value

    def _describe(self, program: Program, span: Span) -> None:
        params: dict[str, Any] = {}
        for param_set in program.params:
            params |= param_set if isinstance(param_set, dict) else {}
        described = program.description
        if described is None and program.argv and program.argv[0].endswith(".urdf"):
            described = Description(file=program.argv[0])
        if described is None:
            self.draft.todo("robot_state_publisher without a known description", span)
            return
        rest = {key: value for key, value in params.items() if key != "robot_description"}
        self._state_publisher_params(rest, program, span)
        if self._only_when:
            self.draft.todo(f"robot_state_publisher is there only when {self._only_when}", span)
        self.descriptions.append(
            replace(described, span=span, prefix=str(rest.get("frame_prefix", "")))
        )

    def _state_publisher_params(
        self, params: dict[str, Any], program: Program, span: Span
    ) -> None:
        ros, joints = (
            self.draft.sections["ros"],
            self.draft.sections["processes"].setdefault("joints", {}),
        )
        if "use_sim_time" in params:
            self.draft.clocks.append((STATE_PUBLISHER, params["use_sim_time"], span))
        kept = {
            key: params[key] for key in ("publish_frequency", "ignore_timestamp") if key in params
        }
        if kept and not self.draft.is_adopted:
            joints.setdefault("params", {}).update(kept)
            self.draft.note(
                ("processes", "joints"), where(span, "what robot_state_publisher is told")
            )
        if not joints:
            del self.draft.sections["processes"]["joints"]
        handled = {
            "use_sim_time",
            "publish_frequency",
            "ignore_timestamp",
            "frame_prefix",
            "use_tf_static",
        }
        for key in params.keys() - handled:
            self.draft.todo(f"robot_state_publisher: the parameter {key}", span)
        space = (program.namespace or "").strip("/")
        if space and ros.setdefault("namespace", space) != space:
            message = f"a robot in {space}, where another one is in {ros['namespace']}"
            self.draft.todo(message, span, advice=SEVERAL)
        moved = dict(program.remap)
        if not is_isolated(self.draft, moved, program.namespace):
            self.draft.todo(f"robot_state_publisher is remapped: {moved}", span)
        for message in program.todo:
            self.draft.todo(message, span)

    def _include(self, record: dict[str, Any], span: Span) -> None:
        """Add a process for an included launch file whose package is not found."""
        package, _, file = record["file"].removeprefix(PACKAGE).partition("/")
        keys: dict[str, Any] = {"run": {"launch": f"{package}/{file.removeprefix('launch/')}"}}
        todo: list[str] = []
        if record["args"]:
            keys["run"]["args"] = {
                key: _without_texts(value, todo) for key, value in record["args"].items()
            }
        namespace = (record.get("namespace") or "").strip("/")
        keys |= {"namespace": namespace} if namespace else {}
        env = self._env(record)
        keys |= {"env": env} if env else {}
        name = posixpath.basename(file).partition(".")[0]
        name = self.draft.process(
            name, keys, where(span, "an included launch file, which runs as one process")
        )
        self._conditions(record, ("processes", name))
        for message in todo:
            self.draft.todo(message, span, ("processes", name))
        if record.get("after"):
            self._after.append((name, record["after"]))
        if record.get("period"):
            self._delays.append((name, record["period"]))

    def _lifecycle(self, record: dict[str, Any], span: Span) -> None:
        name = self._names.get(str(record["node"]))
        if name is None:
            self.draft.todo("a change of a lifecycle node's state", span)
        else:
            process = self.draft.started_entries()[name]
            (node,) = process.get("nodes", {"": process}).values()
            if node.get("lifecycle") != "active":
                node["lifecycle"] = record["state"]

    def _keep_required(self, record: dict[str, Any], span: Span) -> None:
        name = self._names.get(str(record["node"]))
        if name is None:
            self.draft.todo("the end of a process that stops everything", span)
        else:
            self.draft.started_entries()[name]["required"] = True

    def _delay(self) -> None:
        """Let processes in a timer wait for a process that is ready after the period."""
        processes, started = self.draft.sections["processes"], self.draft.started_entries()
        gates: dict[float, str] = {}
        unfit = {name for name, _ in self._delays}
        unfit |= {self._names.get(key, "") for _, after in self._after for key in after}
        for name, period_s in self._delays:
            if period_s not in gates:
                free = [
                    own_name
                    for own_name in self._names.values()
                    if own_name not in unfit
                    and own_name not in gates.values()
                    and "run" in started[own_name]
                    and not {"ready", "after", "when"} & processes[own_name].keys()
                ]
                if free:
                    gates[period_s] = free[0]
                    processes[free[0]]["ready"] = {"time": _seconds(period_s)}
                else:
                    text = number(period_s)
                    gate = self.draft.process(
                        f"delay_{text}", {"run": ["sleep", text]}, "the time of a timer"
                    )
                    gates[period_s] = gate
            gate = gates[period_s]
            what = "done" if processes[gate]["run"] == ["sleep", number(period_s)] else "ready"
            started[name].setdefault("after", {})[gate] = what


def _full_name(program: Program) -> str:
    return f"{(program.namespace or '').rstrip('/')}/{program.name}"


def _seconds(value: float) -> Bare:
    return Bare(f"{number(value)} s")


def _without_texts(argument: str, todo: list[str]) -> str:
    """Return a command's argument, with file names instead of xacro output and contents."""
    todo += [
        f"an argument is what is made of {relative(part.file)}, or its text: here it is the"
        " file's name"
        for part in files_in(argument)
    ]
    return fill(argument, FileText)


def _exact(record: dict[str, Any]) -> range:
    """Return the indices of the parameters that launch passes under the node's full name."""
    if record.get("name") is None or record.get("namespace") is None:
        return range(0)
    return range(record.get("common", 0), len(record["params"]))


def _split_description(params: list[Any], todo: list[str]) -> tuple[list[Any], Description | None]:
    """Return parameters without descriptions, and the robot's description."""
    description: Description | None = None
    kept: list[Any] = []
    for param_set in params:
        if isinstance(param_set, str):
            kept.append(param_set)
            continue
        params_of_node = {}
        for key, value in param_set.items():
            if key == "robot_description" and isinstance(value, str):
                description = _description(value)
            elif files := files_in(value):
                todo.append(f"the parameter {key}, which is the text of {files[0].file}")
            elif value is None or value == [] or not _is_uniform(value):
                todo.append(f"the parameter {key}: {value!r}")
            else:
                params_of_node[key] = value
        kept.append(params_of_node)
    return kept, description


def _as_in_file(value: Any) -> Any:
    """Return parameters as rcl reads them in the parameter file that launch writes.

    launch writes the text 1e5 without quotes, and rcl then reads it as a number.
    """
    if isinstance(value, dict):
        return {key: _word(item) for key, item in value.items()}
    return value


def _word(value: Any) -> Any:
    if isinstance(value, list):
        return list(map(_word, value))
    if not isinstance(value, str) or isinstance(value, Text) or value_of_word(value) == value:
        return value
    return value if yaml.safe_dump(value).startswith(("'", '"')) else value_of_word(value)


def _is_uniform(value: Any) -> bool:
    if not isinstance(value, list):
        return True
    if all(isinstance(item, str) for item in value):
        return True
    return len({type(item) for item in value}) == 1 and isinstance(value[0], (bool, int, float))


def _description(value: str) -> Description:
    files = files_in(value)
    return Description(files[0].file, files[0].args) if files else Description(text=value)
