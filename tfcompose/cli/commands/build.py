"""Write the URDF, the plan and other files, or none of them.

Write plan.json, URDF and xacro files, tree.txt, tree.svg and the parameter files of drivers and
nodes, or none of them on an error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_ros_args, add_variant

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)
    add_ros_args(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="default: build/ROBOT")
    parser.add_argument(
        "--mesh",
        choices=("package", "file", "relative"),
        default="as-written",
        help=(
            "addresses of meshes: package://…, file:///…, or relative to DIR; default: as in "
            "the source"
        ),
    )
    parser.add_argument(
        "--read-back",
        action="store_true",
        help="parse the URDF with yourdfpy, and write nothing if its links, joints, poses, "
        "limits, masses, shapes or materials differ from the robot; needs tfcompose[view]",
    )


def run(arguments: Namespace) -> int:
    """Build; exit code 0, 1 with errors in the robot, 2 if something is unreadable."""
    from tfcompose.cli.writing import build
    from tfcompose.model.plan import DESCRIPTION, STOCK_DESCRIPTION

    folder, names, _ = build(arguments)
    print(f"wrote {folder}: {', '.join(names)}")
    print(
        f"{STOCK_DESCRIPTION} is {DESCRIPTION} for a stock robot_state_publisher: the root has no"
        " inertia, of which KDL would warn, and edges of other owners are floating"
    )
    return 0
