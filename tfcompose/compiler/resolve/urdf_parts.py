"""Parts from a URDF or xacro file, or from a macro in such a file."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, TypeGuard

from tfcompose.compiler.resolve.isolation import topics_below
from tfcompose.compiler.resolve.poses import pose_of
from tfcompose.compiler.resolve.processes import full_name
from tfcompose.compiler.resolve.stock import stock_faults, with_stock
from tfcompose.compiler.urdf.blocks import read_block, with_hardware
from tfcompose.compiler.urdf.convert import robot_of
from tfcompose.compiler.urdf.read import read_expansion, read_xml
from tfcompose.compiler.urdf.xacro import Use, macros_in
from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.foundation.geometry import Pose, rpy_from_quat
from tfcompose.model.robot import BUILT_IN, Node, Process, Robot
from tfcompose.spec.language.robot import Origin
from tfcompose.spec.language.variables import OF_FILES
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.compiler.resolve.part import PartEntry
    from tfcompose.compiler.urdf.packages import Disk, Packages
    from tfcompose.compiler.urdf.xacro import Expansion
    from tfcompose.model.plan import RosSettings
    from tfcompose.spec.load import Path


@dataclass(frozen=True, slots=True)
class Foreign:
    """The robot of a URDF or xacro file."""

    robot: Robot
    #: The files that describe the robot.
    files: tuple[str, ...]
    #: Errors and missing files. Other warnings are only of interest to the file's author.
    findings: tuple[Finding, ...]
    #: Parent frames that the file does not define. If a macro makes the part, the including robot
    #: defines them.
    implied: frozenset[str] = frozenset()


def resolve_urdf_part(part: PartEntry, packages: Packages, read: Callable[[str], str]) -> Foreign:
    """Return the robot of a part that is a URDF or xacro file.

    Raises:
        RejectedError: if the file is missing or invalid, or xacro fails.
    """
    spec = part.declared
    key = "urdf" if spec.urdf is not None else "xacro"
    span = part.spec.span_of((*part.path, key))
    file = packages.path_of(spec.urdf or spec.xacro or "", span)
    files: tuple[str, ...] = (file,)
    attachment = _attachment_arguments(part, read(file)) if spec.macro is not None else {}
    if spec.urdf is not None:
        text = read(file)
        root = read_xml(text, file)
    else:
        expansion = _expand_part(part, file, span, packages, attachment)
        text, files = expansion.text, tuple(dict.fromkeys((file, *expansion.files)))
        root = read_expansion(expansion, file, read)
    converted = robot_of(root, file, packages.asset, files)
    robot = converted.robot
    if not robot.frames:
        macros = macros_in(read(file))
        advice = (
            f"it defines macros; call one with xacro: and macro: {', '.join(macros)}"
            if macros
            else ""
        )
        raise RejectedError([finding("TF206", f"{file} has no links", span, help=advice)])
    robot = with_hardware(robot)
    if attachment:
        robot = _without_edge(robot, attachment, part)
    parents = {edge.parent for edge in robot.edges}
    implied = (
        frozenset(parents - robot.frames.keys()) if spec.macro is not None else frozenset[str]()
    )
    digest = hashlib.sha256(text.encode()).hexdigest()
    findings = [
        finding
        for finding in (*converted.of_elements, *converted.of_blocks)
        if finding.severity == "error"
    ]
    findings += converted.of_files
    robot = replace(
        robot, source_numbers=(), source_data={"urdf": digest}
    )  # ``lint`` of the URDF checks its numbers
    part_robot = _with_base(replace(robot, ros=part.settings, processes=_publishers_of(part)))
    if part.declared.is_alone and part.spec.ros.state_publisher == "stock" and part_robot.base:
        findings += stock_faults(part_robot)
        part_robot = with_stock(part_robot)
    return Foreign(part_robot, files, tuple(findings), implied)


def _with_base(robot: Robot) -> Robot:
    roots = robot.roots()
    return replace(robot, base=roots[0] if len(roots) == 1 else None)


def _expand_part(
    part: PartEntry, file: str, span: Span, packages: Packages, attachment: Mapping[str, str]
) -> Expansion:
    disk, spec = packages.disk, part.declared
    if disk is None:
        raise RejectedError([finding("TF001", f"{file}: files cannot be read here", span)])
    args = {
        name: _with_files(value, (*part.path, "args", name), part, disk)
        for name, value in spec.args.items()
    }
    return disk.expand(file, packages, args, _use(part, file, packages, disk, attachment))


def _with_files(value: Any, path: Path, part: PartEntry, disk: Disk) -> Any:
    """Return the value with each ``${file(PATH)}`` replaced by an absolute path.

    A relative PATH starts at the folder of the robot file.
    """
    span = part.spec.span_of(path)

    def absolute(call: re.Match[str]) -> str:
        place = find_path(call[2], span)
        if not (disk.is_file(place) or disk.is_folder(place)):
            message, advice = (
                f"{call[0]}: {place} does not exist",
                "paths are relative to the file that contains them",
            )
            raise RejectedError([finding("TF019", message, span, help=advice)])
        return str(FilePath(place).absolute())

    return OF_FILES.sub(absolute, value) if isinstance(value, str) else value


#: Usual parameters of macros for the parent link, and for the block with the pose.
_PARENTS, _ORIGIN = ("parent_link", "parent", "parent_frame", "connected_to"), "origin"


#: The declaration of a macro's parameter, and its default.
_PARAMETER = re.compile(r"(\*{0,2}[A-Za-z_]\w*)(?:\s*:?=\s*('[^']*'|\S+))?")


def _attachment_arguments(part: PartEntry, text: str) -> dict[str, str]:
    """Return the arguments for a macro that takes a parent and perhaps an origin.

    The parent is the part's key ``parent``. The origin is the identity, because the part's own
    keys determine its pose.
    """
    spec = part.declared
    defaults = dict(_PARAMETER.findall(macros_in(text).get(spec.macro or "", "")))
    parents = [name for name in _PARENTS if name in defaults and defaults[name] != "''"]
    if spec.parent is None or not parents or spec.params.keys() & {*_PARENTS, _ORIGIN}:
        return {}
    attachment = {parents[0]: spec.parent[0]}
    return attachment | ({_ORIGIN: "<origin/>"} if f"*{_ORIGIN}" in defaults else {})


def _without_edge(robot: Robot, attachment: Mapping[str, str], part: PartEntry) -> Robot:
    """Return the macro's robot without the joint that attaches it to the parent.

    The part's mount edge replaces this joint.

    Raises:
        RejectedError: if there are several such joints, or the joint moves or has a pose.
    """
    parent = next(iter(attachment.values()))
    joints = [edge for edge in robot.edges if edge.parent == parent and parent not in robot.frames]
    if not joints:
        return robot
    edge = joints[0]
    if joints[1:] or edge.kind != "static" or edge.pose != Pose():
        what = (
            "several joints"
            if joints[1:]
            else f"the joint {edge.joint_name}, which is not simply fixed there"
        )
        advice = (
            "leave parent out, and give the macro its parent and pose: params:"
            f" {{{next(iter(attachment))}: {parent}, …}}"
        )
        message = f"the macro {part.declared.macro} is attached to {parent} by {what}"
        raise RejectedError(
            [finding("TF313", message, part.spec.span_of((*part.path, "parent")), help=advice)]
        )
    if part.declared.joint is None:
        part.declared = part.declared.model_copy(
            update={"joint": f"{part.prefix}{edge.joint_name}"}
        )
    return replace(robot, edges=tuple(kept for kept in robot.edges if kept is not edge))


def _use(
    part: PartEntry, file: str, packages: Packages, disk: Disk, attachment: Mapping[str, str]
) -> Use:
    """Return how the part uses the file: the complete file, or a call of its macro."""
    spec, path = part.declared, part.path
    if spec.macro is None:
        return Use(part.spec.span_of((*path, "xacro")))
    places = (part.spec.span_of((*path, "include", index)) for index in range(len(spec.include)))
    files = (
        *(packages.path_of(file, span) for file, span in zip(spec.include, places, strict=True)),
        file,
    )
    parameters: dict[str, str] = {
        name: value for name, value in attachment.items() if name != _ORIGIN
    }
    blocks = [attachment[_ORIGIN]] if _ORIGIN in attachment else []
    for name, value in spec.params.items():
        if _is_markup(value):
            _refuse_broken(name, value, part.spec.span_of((*path, "params", name)))
        block = _block(value)
        if block is None:
            parameters[name] = _word(_with_files(value, (*path, "params", name), part, disk))
        else:
            blocks.append(block)
    named = {name: part.spec.key_span((*path, "params", name)) for name in spec.params}
    return Use(
        part.spec.span_of((*path, "macro")),
        spec.macro,
        parameters,
        blocks=tuple(blocks),
        files=files,
        places=named,
    )


def _is_markup(value: Any) -> TypeGuard[str]:
    return isinstance(value, str) and value.lstrip().startswith("<")


def _refuse_broken(name: str, text: str, span: Span) -> None:
    try:
        read_block(text, span.file)
    except RejectedError as error:
        findings = (
            replace(finding, span=span, message=f"block {name}: {finding.message}")
            for finding in error.findings
        )
        raise RejectedError(findings) from None


def _block(value: Any) -> str | None:
    """Return the XML element that a parameter stands for, None for a plain value."""
    if isinstance(value, Origin):
        pose = pose_of(value)
        xyz, rpy = (
            " ".join(map(repr, numbers)) for numbers in (pose.xyz, rpy_from_quat(pose.quat_xyzw))
        )
        return f'<origin xyz="{xyz}" rpy="{rpy}"/>'
    return value if _is_markup(value) else None


def _word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _publishers_of(part: PartEntry) -> tuple[Process, ...]:
    """Return the publishers of a part that is a separate robot."""
    settings: RosSettings = part.settings
    remap = topics_below(settings.namespace, part.isolate)
    return tuple(
        Process(
            name,
            name,  # type: ignore[arg-type]  # the built-in processes are called by their kinds
            span=part.span,
            ros_nodes=(Node(full_name(settings.namespace, f"tfcompose_{name}"), part.span),),
            remap=remap,
        )
        for name in BUILT_IN
    )
