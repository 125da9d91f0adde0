"""Lint a URDF, or a xacro file, that tfcompose did not write; places are those of that file."""

from __future__ import annotations

from dataclasses import replace

from tfcompose.check import apply, check, idle
from tfcompose.cli.disk import disk
from tfcompose.cli.terminal import read_text
from tfcompose.cli.xacro import expanded
from tfcompose.diagnostic import Diagnostic, RejectedError
from tfcompose.load.comments import allows_in_xml
from tfcompose.load.urdf import load_xml
from tfcompose.resolve.packages import Packages
from tfcompose.resolve.urdf import robot_of_urdf

#: The rules that make sense without owners, sensors and processes.
CODES = frozenset(
    {"TF201", "TF202", "TF203", "TF204", "TF205", "TF206", "TF209", "TF401", "TF501", "TF503"}
    | {"TF701", "TF702", "TF704", "TF705", "TF706", "TF707", "TF708", "TF709", "TF710", "TF711"}
)

#: What to do, in URDF's words, where a rule speaks of YAML. Advice that names a near word is kept.
_HELP = {
    "TF203": 'add <link name="…"/>',
    "TF204": "join the trees with a fixed joint",
    "TF206": 'add <link name="base_link"/>',
    "TF209": "remove it, or give it a joint",
    "TF401": 'an optical frame has <origin rpy="-1.5707963267948966 0 -1.5707963267948966"/> in its camera\'s frame',
    "TF704": '<limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>; without an end it is continuous',
    "TF709": 'add <inertial> with <mass value="…"/> and <inertia …/>',
    "TF710": "take the tensor from CAD: in kg m², about the centre of mass",
    "TF711": "give it in kg m², about the centre of mass",
}


def lint_urdf(file: str) -> list[Diagnostic]:
    """Return what is wrong with the file, by place. A xacro file is expanded, and places are those of the result."""
    try:
        packages = Packages(disk())
        is_xacro = file.endswith(".xacro")
        name, text = (f"{file} (expanded)", expanded(file, packages)) if is_xacro else (file, read_text(file))
        robot, found = robot_of_urdf(load_xml(text, name), name, packages.asset)
    except RejectedError as error:
        return list(error.diagnostics)
    allows = allows_in_xml(text, name)
    kept, used = apply(dict.fromkeys([*found, *(_said(one) for one in check(robot, CODES))]), allows)
    return sorted([*kept, *idle(allows, used)], key=lambda one: one.sort_key)


def _said(found: Diagnostic) -> Diagnostic:
    """Return the finding with its advice in URDF's words."""
    keeps = found.help.startswith("did you mean")
    return found if keeps else replace(found, help=_HELP.get(found.code, found.help))
