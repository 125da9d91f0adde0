"""``parts:`` in a robot file: another robot as a subtree, or beside others on one map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.edges import MountKeys
from tfcompose.validate.fields import ANYTHING, NAMESPACE, TEXT
from tfcompose.validate.posed import Posed
from tfcompose.validate.schema import BROKEN, Problems, Type, key, listing, mapping, record

if TYPE_CHECKING:
    from tfcompose.load import Path

_WHERE = "relative to the file that names it, package://NAME/PATH or $(find NAME)/PATH"


class Block(Posed):
    """What a macro takes as an origin."""


def _param(value: Any, path: Path, problems: Problems) -> Any:
    """Read a macro's parameter: a pose is one, with units and all; everything else is passed on as it is."""
    return (record(Block) if isinstance(value, dict) else ANYTHING).read(value, path, problems)


PARAM = Type(_param, {"anyOf": [Block, {"type": ["string", "number", "boolean", "array"]}]})


class PartSpec(MountKeys):
    """Another robot as a part: one of spec, urdf and xacro. Everywhere else in this file its names have the prefix."""

    spec: str | None = key(TEXT, None, "a robot file; relative to the file that names it", ("rover.yaml",))
    urdf: str | None = key(TEXT, None, f"a URDF file; {_WHERE}", ("package://ur_description/urdf/ur5e.urdf",))
    xacro: str | None = key(TEXT, None, f"a xacro file; {_WHERE}", ("$(find ur_description)/urdf/ur.urdf.xacro",))
    args: dict[str, Any] = key(
        mapping(ANYTHING), {}, "arguments of the xacro file", ({"name": "ur", "ur_type": "ur5e"},)
    )
    macro: str | None = key(TEXT, None, "a macro that the xacro file defines, and that is called", ("hokuyo_ust10",))
    params: dict[str, Any] = key(
        mapping(PARAM),
        {},
        "the macro's parameters; a pose, or text that begins with <, for one that takes a block",
        ({"name": "front", "parent_link": "base_link", "origin": {"xyz": [0.3, 0, 0.1]}},),
    )
    include: tuple[str, ...] = key(listing(TEXT, single=True), (), "further xacro files that the macro needs")
    prefix: str | None = key(
        TEXT, None, "written in front of the part's frames and joints as it is; with its slash", ("robot1/",)
    )
    namespace: str | None = key(
        NAMESPACE, None, "makes the part a robot of its own, with its own static and joints; below ros.namespace"
    )
    profiles: tuple[str, ...] = key(listing(TEXT, single=True), (), "profiles of the robot file", (["demo"],))
    vars: dict[str, Any] = key(mapping(ANYTHING), {}, "values for variables of the robot file")
    root: str | None = key(TEXT, None, "only what is below this frame of the part; without the prefix", ("base_link",))
    place: str | None = key(TEXT, None, "the pose is this frame's; the mount edge is solved for")
    owner: str | None = key(TEXT, None, "the process that publishes every edge of the part")


#: What can be the part, and which keys go with it alone.
KINDS = {"spec": ("vars", "profiles"), "urdf": (), "xacro": ("args", "macro", "params", "include")}
_MACRO = ("params", "include")
#: What a file is by its ending. xacro reads plain URDF too, so that xacro: FILE.urdf is right.
_ENDINGS = {".urdf": "urdf", ".xacro": "xacro", ".yaml": "spec", ".yml": "spec"}


def _part(value: Any, path: Path, problems: Problems) -> Any:
    """Read a part, and refuse one that is nothing, or has keys of another kind of part."""
    if isinstance(value, dict):
        kind = next((kind for kind in KINDS if kind in value), None)
        if kind is None and set(value) <= set(PartSpec.KEYS):
            problems.refuse("TF102", path, "a part without a robot", "give spec, urdf or xacro", on_key=True)
        other_kind = kind is not None and _is_refused(value[kind], kind, (*path, kind), problems)
        for other, keys in KINDS.items():
            for name in keys:
                if name in value and kind not in {None, other}:
                    problems.refuse("TF107", (*path, name), f"{name} goes with {other}, not with {kind}", on_key=True)
        for name in _MACRO:
            if name in value and "macro" not in value:
                problems.refuse("TF102", (*path, name), f"{name} without a macro", "macro: NAME", on_key=True)
        if other_kind:
            return BROKEN
    return record(PartSpec).read(value, path, problems)


def _is_refused(file: Any, kind: str, path: Path, problems: Problems) -> bool:
    """Whether the file is another kind of part, by its ending."""
    ending = next((one for one in _ENDINGS if isinstance(file, str) and file.endswith(one)), "")
    meant = _ENDINGS.get(ending, kind)
    is_other = meant != kind and (kind, meant) != ("xacro", "urdf")
    if is_other:
        what = "a robot file" if meant == "spec" else f"a {ending[1:]} file"
        problems.refuse("TF106", path, f"{file} is {what}", f"{meant}: instead of {kind}:")
    return is_other


PART = Type(_part, PartSpec)
