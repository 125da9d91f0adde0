"""The edits of ``tfcompose adopt --status``, applied as a person would."""

import re
from pathlib import Path

from tests.support.cli import tfcompose_in

_EDIT = re.compile(r"  (remove|write)   ?(\S+?):(\d+)(?::\d+)?(?:, to line (\d+))?: (.*)")
_UNKNOWN = "  remove  in the launch file: "

#: Three stock publishers of fixed edges; they are at lines 2 to 4.
PUBLISHERS = """<launch>
  <node pkg="tf2_ros" exec="static_transform_publisher" name="lidar_tf" args="--x 0.2 --z 0.3 --yaw 0.7853981633974483 --frame-id base_link --child-frame-id lidar"/>
  <node pkg="tf2_ros" exec="static_transform_publisher" name="imu_tf" args="--x 0.1 --roll 0.1 --pitch -0.2 --yaw 2 --frame-id base_link --child-frame-id imu"/>
  <node pkg="tf2_ros" exec="static_transform_publisher" name="gnss_tf" args="--z 1 --qx 0.5 --qy 0.5 --qz 0.5 --qw 0.5 --frame-id lidar --child-frame-id gnss"/>
</launch>
"""  # noqa: E501 (a text as its reader has it)


def status_of(folder: Path, robot: str, *launch: str) -> list[str]:
    """Return the lines of ``adopt --status``."""
    done = tfcompose_in(folder, "adopt", "--status", robot, *launch)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def hand_over_first(folder: Path, robot: str, *launch: str) -> str:
    """Apply the edits of the first step; return the line that names its edges.

    Without a launch file, ending its publisher is up to the caller.
    """
    lines = status_of(folder, robot, *launch)
    end = next((index for index, line in enumerate(lines[1:], 1) if line[0] != " "), len(lines))
    texts = {name: (folder / name).read_text("utf-8").split("\n") for name in (robot, *launch)}
    for line in lines[1:end]:
        if line.startswith(_UNKNOWN) and not launch:
            continue
        match = _EDIT.fullmatch(line)
        assert match, line
        do, file, first, last, text = match.groups()
        count = int(last or first) - int(first)
        lines_of_file = [f"  {text}" if do == "write" else "", *[""] * count]
        texts[Path(file).name][int(first) - 1 : int(first) + count] = lines_of_file
    for name, kept in texts.items():
        (folder / name).write_text("\n".join(kept), encoding="utf-8")
    return lines[0]
