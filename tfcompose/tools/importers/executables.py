"""Entries of a robot file for the programs that a script or a launch file starts.

A ``static_transform_publisher`` becomes a frame. A ``robot_state_publisher`` becomes a part or
links, made from its description. A ``joint_state_publisher`` becomes a process that simulates
joint states. All other programs become processes.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.containers import PROGRAMS
from tfcompose.compiler.resolve.presets import node_preset, node_preset_names
from tfcompose.foundation.numbers import number
from tfcompose.foundation.reach import OutsideError
from tfcompose.foundation.yaml_text import Bare
from tfcompose.tools.importers.command_lines import with_ros_arguments
from tfcompose.tools.importers.draft import where
from tfcompose.tools.importers.launch_records import PACKAGE
from tfcompose.tools.importers.node_params import MOST_BYTES, bring_files, node_in_files, params_of
from tfcompose.tools.importers.program import CONTAINERS, JOINT_PUBLISHERS
from tfcompose.tools.importers.robot_settings import is_isolated
from tfcompose.tools.importers.static_transforms import (
    PROGRAM,
    ArgumentsRefusedError,
    reader_of,
    static_transform,
)
from tfcompose.tools.importers.texts import concatenate, partition

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.files import Target
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.program import Program

_FROM_TOPIC = (
    "nothing, if the node takes the description from the topic robot_description, where tfcompose"
    " publishes it"
)
#: A component's package and class that need no quotes in YAML.
_PLUGIN = re.compile(r"[A-Za-z]\w*/[A-Za-z_]\w*(::\w+)*", re.ASCII)
#: The positions between the words of a class name.
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
#: Default rate of joint_state_publisher, in Hz.
_JOINTS_HZ = 10.0


def add_program(draft: ImportDraft, program: Program, target: Target) -> str | None:
    """Add a program to the draft; return the name of its process, None if it is not a process.

    This function does not add a robot_state_publisher: ``urdf.add_descriptions`` makes links or a
    part from its description.
    """
    program = with_ros_arguments(program)
    if program.executable == PROGRAM:
        _add_transform(draft, program)
        return None
    if program.executable in JOINT_PUBLISHERS and not draft.is_adopted:
        return _add_joint_publisher(draft, program)
    return _add_process(draft, program, target)


def _add_transform(draft: ImportDraft, program: Program) -> None:
    span = program.span
    moved = dict(program.remap)
    reader = program.reader or reader_of(program.argv)
    try:
        transform = static_transform(program.argv, reader)
    except ArgumentsRefusedError as error:
        draft.todo(
            f"{PROGRAM} {' '.join(program.argv)}: {error}", span, advice="write the frame by hand"
        )
        return
    notes = [where(span, transform.order)]
    keys = transform.keys()
    entry = ("frames", transform.child)
    draft.publishers.setdefault(transform.child, span)
    if draft.is_adopted and transform.child not in draft.sections["frames"]:
        keys |= {"owner": _add_external(draft, program), "static": True}
    added = draft.frame(transform.parent, transform.child, keys, span, *notes)
    if added and not is_isolated(draft, moved, program.namespace):
        remaps = ", ".join(f"{old} → {new}" for old, new in moved.items())
        draft.todo(
            f"the publisher is remapped: {remaps}",
            span,
            entry,
            advice="ros: {namespace: …, isolate: topics}",
        )
    for message in program.todo:
        draft.todo(message, span, entry)


def _add_external(draft: ImportDraft, program: Program) -> str:
    """Add an external process for a publisher that the launch file keeps; return its name."""
    namespace = (program.namespace or "").strip("/")
    if program.name is None:
        draft.todo(
            f"{PROGRAM} changes its node name at each start",
            program.span,
            advice="name its node in the launch file, or hand its edge over first",
        )
    node = "/".join(("", *filter(None, (namespace, program.name or PROGRAM))))
    name = draft.free_name(program.name or PROGRAM)
    keys = {"external": True} | ({} if node == f"/{name}" else {"node": node})
    return draft.process(name, keys, where(program.span))


def _add_joint_publisher(draft: ImportDraft, program: Program) -> str:
    """Add a process that simulates joint states; return its name.

    All joints are at 0, which is the default of joint_state_publisher.
    """
    params: dict[str, Any] = {}
    for param_set in program.params:
        params |= param_set if isinstance(param_set, dict) else {}
    zeros = {
        name.partition(".")[2]: value
        for name, value in params.items()
        if name.startswith("zeros.")
    }
    rate = params.get("rate", _JOINTS_HZ)
    rate = (
        float(rate)
        if isinstance(rate, (int, float)) and not isinstance(rate, bool)
        else _JOINTS_HZ
    )
    simulate: dict[str, Any] = {"joints": zeros or "zero", "rate": _hertz(rate)}
    notes = [where(program.span, f"in the place of {program.executable}")]
    name = draft.process(
        program.name or program.executable or "joints", {"simulate": simulate}, *notes
    )
    entry = ("processes", name)
    if str(program.executable).endswith("_gui"):
        draft.note(entry, "it has no sliders: tfcompose view has")
    left = [
        key
        for key in params
        if key != "rate" and not key.startswith("zeros.") and key != "use_sim_time"
    ]
    for key in left:
        draft.todo(f"{program.executable}: the parameter {key}", program.span, entry)
    for message in (
        *program.todo,
        *(f"parameters of {file}" for file in program.params if isinstance(file, str)),
    ):
        draft.todo(message, program.span, entry)
    return name


def _hertz(value: float) -> Any:
    return f"{number(value)} Hz"


def _add_process(draft: ImportDraft, program: Program, target: Target) -> str:
    span, todo, advice = program.span, list(program.todo), ""
    program = replace(
        program, argv=tuple(bring_files(argument, draft) for argument in program.argv)
    )
    source_name = program.name
    if not program.name and program.package and (name := node_in_files(program.params, draft)):
        program = replace(program, name=name)
    usual = (
        _usual_name(program.package)
        if program.package and not program.name and not program.plugin
        else None
    )
    preferred = (
        (program.name and program.label)
        or program.name
        or usual
        or program.label
        or _plain(program)
        or "process"
    )
    name = draft.free_name(preferred)
    keeps_name = not source_name and _keeps_its_name(program)
    params = params_of(program, target, program.name or name, draft, keeps_name=keeps_name)
    program = replace(program, argv=(*program.argv, *params.argv))
    draft.clocks.append((name, params.clock, span))
    keys = _way(program)
    notes = [where(span)]
    if keeps_name:
        settings = {"params": params.of_node} if params.of_node else {}
        keys["nodes"] = {program.name or usual or name: settings}
        if not program.name and not usual:
            notes.append(f"the source does not name the node: {name} is a guess")
    elif program.name and program.name != name:
        keys["node"] = program.name
    if program.namespace and program.namespace.strip("/"):
        keys["namespace"] = program.namespace.strip("/")
    keys |= {"params": params.common} if params.common else {}
    keys |= {"remap": remappings(program.remap)} if program.remap else {}
    keys |= {"env": dict(program.env)} if program.env else {}
    keys |= dict(program.keys)
    section = "containers" if program.loads else "processes"
    draft.process(name, keys, *(note for note in notes if note), section=section)
    for argument in _texts((*program.argv, *program.env.values())):
        if PACKAGE in argument and not _is_literal(argument, span, draft):
            todo.append(f"{argument} is in a package that was not found: write its path")
            advice = "--package NAME=FOLDER, or source the workspace's setup file"
    for message in (*todo, *params.left):
        draft.todo(message, span, (section, name), advice)
    if program.description is not None:
        draft.todo("the parameter robot_description", span, (section, name), _FROM_TOPIC)
    return name


def _is_literal(text: str, span: Span | None, draft: ImportDraft) -> bool:
    """Whether all ``package://`` addresses in the text are also in the source file.

    If they are not, the import made them from paths in a package that it did not find.
    """
    try:
        source = draft.reach.read(span.file, MOST_BYTES) if span else b""
    except (OutsideError, OSError):
        return False
    return all(address.encode() in source for address in re.findall(rf"{PACKAGE}\w+", text))


def _keeps_its_name(program: Program) -> bool:
    """Whether the nodes of a program without a name keep the names in their code.

    A name on the command line would rename all nodes of the program.
    """
    return program.package is not None and not program.plugin and not program.loads


def remappings(rules: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return remappings in the form of a robot file.

    If several rules have the same name, ROS uses the first rule.
    """
    return dict(reversed(list(dict(reversed(rules)).items())))


def _way(program: Program) -> dict[str, Any]:
    """Return the keys with which the robot file starts the program."""
    if program.plugin:
        name = f"{program.package}/{program.plugin}"
        return {"component": Bare(name) if _PLUGIN.fullmatch(name) else name, "container": ""}
    if program.loads:
        return _container_keys(program)
    return {"run": _run(program)} | ({"shell": True} if program.shell else {})


def _container_keys(program: Program) -> dict[str, Any]:
    """Return the keys of a container.

    A stock container has ``isolation`` and ``executor``. Any other container has ``package`` and
    ``executable``.
    """
    argv = list(program.argv)
    is_stock = program.package == CONTAINERS
    keys: dict[str, Any] = {} if is_stock else {"package": program.package}
    for (isolation, executor), (name, arguments) in reversed(PROGRAMS.items()):
        if is_stock and program.executable == name and set(arguments) <= set(argv):
            argv = [argument for argument in argv if argument not in arguments]
            keys |= {"isolation": isolation} if isolation != "shared" else {}
            keys |= {"executor": executor} if executor != "single" else {}
            break
    else:
        keys["executable"] = program.executable
    return keys | ({"args": argv} if argv else {})


def _usual_name(package: str) -> str | None:
    """Return the default node name of a package's program, if it is known."""
    names = {
        preset.node
        for preset_name in node_preset_names()
        if (preset := node_preset(preset_name)).package == package
    }
    return names.pop() if len(names) == 1 else None


def _texts(argv: Sequence[Any]) -> list[str]:
    return [argument for argument in argv if isinstance(argument, str)]


def _run(program: Program) -> Any:
    """Return the value of ``run`` for the program."""
    if program.shell:
        return concatenate(program.argv, " ")
    if program.package is not None:
        run: dict[str, Any] = {"package": program.package, "executable": program.executable}
        return run | ({"args": list(program.argv)} if program.argv else {})
    match program.argv:
        case ("ros2", "launch", package, file, *arguments) if (
            all(":=" in argument for argument in arguments)
            and ":=" not in file
            and not package.startswith("-")
        ):
            run = {"launch": f"{package}/{file}"}
            args = {
                left: right
                for left, _, right in (partition(argument, ":=") for argument in arguments)
            }
            return run | ({"args": args} if args else {})
    return list(program.argv)


def _plain(program: Program) -> str:
    """Return the file name of the started program, without its folder and ending."""
    match program.argv:
        case ("ros2", "launch", _, file, *_) if program.package is None:
            stem = file
        case ("ros2", verb, *_) if program.package is None:
            stem = f"ros2_{verb}"
        case _ if program.plugin:
            return _CAMEL.sub("_", program.plugin.rpartition("::")[2]).lower()
        case _:
            stem = program.executable or (
                next(iter(program.argv[0].split()), "") if program.argv else ""
            )
    plain = posixpath.basename(stem).partition(".")[0]
    script = next((argument for argument in program.argv[1:] if argument.endswith(".py")), "")
    return (
        posixpath.basename(script).removesuffix(".py")
        if script and plain.startswith("python")
        else plain
    )
