"""A new pose of a mount becomes edits of the robot file.

The pose is the requested one, and other bytes stay.
"""

import difflib
import math
import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.mounts.edit import Elsewhere, ImmovableError, MountEdits, change_of
from tfcompose.foundation.findings import apply_edits
from tfcompose.foundation.geometry import (
    Pose,
    matrix_from_quat,
    normalise,
    offset_of,
    quat_from_rpy,
    rpy_from_quat,
)
from tfcompose.model.robot import Robot
from tfcompose.spec.load import load

ROBOTS = Path(__file__).parents[3] / "robots"
PRESETS = library()


def compiled(
    text: str, overlay: str = "", profiles: tuple[str, ...] = (), file: str = "r.yaml"
) -> Compiled:
    overlays = [load(overlay, "o.yaml")] if overlay else []
    read = lambda name: (ROBOTS / name.removeprefix("robots/")).read_text("utf-8")  # noqa: E731
    return compile_robot(text, file, PRESETS, profiles, overlays=overlays, read=read)


def robot_of(text: str, overlay: str = "", profiles: tuple[str, ...] = ()) -> Robot:
    done = compiled(text, overlay, profiles)
    assert done.robot
    return done.robot


def pose_in(robot: Robot, child: str) -> Pose:
    edge = robot.parent_edge(child)
    assert edge
    return edge.pose


def moved(text: str, child: str, pose: Pose, profiles: tuple[str, ...] = ()) -> str:
    """Return the text in which the frame has the pose in its parent."""
    done = compiled(text, profiles=profiles)
    assert done.robot
    change = change_of(done.robot, done.sources[0], {"r.yaml": text}, child, pose)
    assert isinstance(change, MountEdits), change
    new = apply_edits(text, change.edits)
    assert new is not None
    off = offset_of(pose, pose_in(robot_of(new, profiles=profiles), child))
    assert off.xyz_m < 1e-6, (text, new)
    assert off.rot_rad < 1e-6, (text, new)
    return new


def kept_elsewhere(text: str, overlay_over: str, child: str, pose: Pose) -> Elsewhere:
    """Return why the pose is not edited; an overlay gives it."""
    done = compiled(text, overlay_over)
    assert done.robot
    change = change_of(done.robot, done.sources[0], {"r.yaml": text}, child, pose)
    assert isinstance(change, Elsewhere)
    overlay = change.overlay(overlay_over, "o.yaml")
    off = offset_of(pose, pose_in(robot_of(text, overlay), child))
    assert off.xyz_m < 1e-6, overlay
    assert off.rot_rad < 1e-6, overlay
    return change


def changed_lines(old: str, new: str) -> list[str]:
    return [
        line[2:]
        for line in difflib.ndiff(old.splitlines(), new.splitlines())
        if line.startswith("+")
    ]


numbers = st.floats(-3, 3).map(lambda value: round(value, 4))
angles = st.floats(-3.1, 3.1) | st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi])
LENGTHS = {
    "": 1.0,
    " m": 1.0,
    " cm": 0.01,
    "mm": 0.001,
    " mm": 0.001,
    " in": 0.0254,
    " ft": 0.3048,
    " um": 1e-6,
}
ANGLES = {"": 1.0, " rad": 1.0, " deg": math.pi / 180, "deg": math.pi / 180, " mrad": 0.001}
poses = st.builds(
    lambda x, y, z, r, p, w: Pose((x, y, z), quat_from_rpy(r, p, w)),
    numbers,
    numbers,
    numbers,
    angles,
    angles,
    angles,
)


@st.composite
def scalars(draw: st.DrawFn, units: dict[str, float]) -> str:
    unit = draw(st.sampled_from(sorted(units)))
    text = f"{round(draw(numbers) / units[unit], 3)}{unit}"
    quote = draw(st.sampled_from(["", "", "'", '"'])) if unit else ""
    return f"{quote}{text}{quote}"


@st.composite
def rotations(draw: st.DrawFn) -> list[str]:
    """Draw the lines of a rotation; none, or one of the ways to write it."""
    form = draw(
        st.sampled_from(["", "rpy", "quat_xyzw", "matrix", "axis_angle", "look", "direction"])
    )
    q = draw(poses).quat_xyzw
    listed = ", ".join(draw(scalars(ANGLES)) for _ in range(3))
    match form:
        case "rpy":
            return [f"rpy: [{listed}]"]
        case "quat_xyzw":
            return [f"quat_xyzw: [{', '.join(f'{part:.9f}' for part in q)}]"]
        case "matrix":
            rows = (", ".join(f"{part:.9f}" for part in row) for row in matrix_from_quat(q))
            return [f"matrix: [{', '.join(f'[{row}]' for row in rows)}]"]
        case "axis_angle":
            axis = f"[{draw(numbers)}, {draw(numbers)}, 1]"
            return [f"axis_angle: {{axis: {axis}, angle: {draw(scalars(ANGLES))}}}"]
        case "look":
            keys = [
                draw(st.sampled_from(["up", "down"])),
                draw(st.sampled_from(["left", "right"])),
                "roll",
            ]
            some = draw(st.lists(st.sampled_from(keys), min_size=1, unique=True))
            return [f"look: {{{', '.join(f'{key}: {draw(scalars(ANGLES))}' for key in some)}}}"]
        case "direction":
            return [f"look: {draw(st.sampled_from(['down', 'left', 'backward', 'up']))}"]
    return []


@st.composite
def robots(draw: st.DrawFn) -> tuple[str, str]:
    """Draw a robot file and the name of a frame in it that is mounted."""
    lines = ["parent: base_link", *draw(rotations())]
    if draw(st.booleans()):
        lines.append(f"xyz: [{', '.join(draw(scalars(LENGTHS)) for _ in range(3))}]")
    if draw(st.booleans()):
        lines.append("relative_to: shelf")
    kind = draw(st.sampled_from(["frame", "optical", "link", "joint", "sensor"]))
    if kind == "sensor":
        lines.append("preset: realsense/d455")
        lines += ["place: cam_color_optical_frame"] if draw(st.booleans()) else []
        lines += ["frames: {cam_color_frame: {xyz: [0, 0.01, 0]}}"]
    if kind == "joint":
        lines += [
            "type: revolute",
            "child: arm",
            "limit: {lower: -1, upper: 1, effort: 1, velocity: 1}",
        ]
    lines = draw(st.permutations(lines))
    section, name, child = {
        "frame": ("frames", "tool", "tool"),
        "optical": ("frames", "lens_optical_frame", "lens_optical_frame"),
        "link": ("links", "box", "box"),
        "joint": ("joints", "elbow", "arm"),
        "sensor": ("sensors", "cam", ""),
    }[kind]
    if draw(st.booleans()):
        entry = f"  {name}: {{{', '.join(lines)}}}  # in braces\n"
    else:
        entry = f"  {name}:  # as a block\n" + "".join(
            f"    {line}  # {line[:3]}\n" for line in lines
        )
    links = (
        "links:\n  base_link: {}\n  shelf: {parent: base_link, xyz: [1, 2, 0.5], rpy: [10 deg,"
        " 0.2, -1]}\n"
    )
    links += "  arm: {}\n" if kind == "joint" else ""
    head = "# a robot\ntfcompose: 1\nrobot: r\n"
    text = head + links + (entry if section == "links" else f"{section}:\n{entry}") + "# the end"
    text = text.replace("\n", "\r\n") if draw(st.booleans()) else text
    return text, child


def child_of(robot: Robot, child: str) -> str:
    return child or robot.sensors[0].mount


@given(robots(), poses, st.sampled_from([(True, False), (False, True), (True, True)]))
@settings(max_examples=40, deadline=None)
def test_a_moved_mount_has_the_requested_pose_and_every_other_byte_stays(
    case: tuple[str, str], new: Pose, changes: tuple[bool, bool]
) -> None:
    (text, child), (moves, rotates) = case, changes
    robot = robot_of(text)
    child = child_of(robot, child)
    old = pose_in(robot, child)
    pose = Pose(new.xyz if moves else old.xyz, new.quat_xyzw if rotates else old.quat_xyzw)
    after = moved(text, child, pose)
    before_data, after_data = load(text, "r.yaml"), load(after, "r.yaml")
    sections = ("frames", "links", "joints", "sensors")
    different = {
        path[:2]
        for path, value in _leaves(after_data.data)
        if path[:1] not in {("tfcompose",), ("robot",)}
        and dict(_leaves(before_data.data)).get(path) != value
    }
    assert len(different) <= 1
    assert all(path[0] in sections for path in different)
    # What is neither a number nor its unit is there as before: comments, keys, brackets, line
    # ends.
    kept = [line.rpartition("#")[2] for line in text.splitlines(keepends=True) if "#" in line]
    assert [
        line.rpartition("#")[2] for line in after.splitlines(keepends=True) if "#" in line
    ] == kept
    assert ("\r\n" in text) == ("\r\n" in after)


def _leaves(
    value: object, path: tuple[str | int, ...] = ()
) -> list[tuple[tuple[str | int, ...], object]]:
    if isinstance(value, dict):
        return [leaf for key, item in value.items() for leaf in _leaves(item, (*path, key))]
    if isinstance(value, list):
        return [leaf for key, item in enumerate(value) for leaf in _leaves(item, (*path, key))]
    return [(path, value)]


@given(robots())
@settings(max_examples=25, deadline=None)
def test_the_pose_that_a_mount_has_needs_no_edit(case: tuple[str, str]) -> None:
    text, child = case
    robot = robot_of(text)
    child = child_of(robot, child)
    assert moved(text, child, pose_in(robot, child)) == text


@given(robots(), poses)
@settings(max_examples=25, deadline=None)
def test_moving_there_and_back_is_the_pose_it_was(case: tuple[str, str], pose_there: Pose) -> None:
    text, child = case
    robot = robot_of(text)
    child = child_of(robot, child)
    moved(moved(text, child, pose_there), child, pose_in(robot, child))


BASE = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"

#: A name, the file, the new xyz and rpy in degrees, the line that is new.
CASES = {
    "one number of three": (
        "frames:\n  tool: {parent: base_link, xyz: [0.1, 20 cm, 30mm]}  # tool\n",
        (0.1, 0.25, 0.03),
        (0, 0, 0),
        "  tool: {parent: base_link, xyz: [0.1, 25 cm, 30mm]}  # tool",
    ),
    "a quantity in quotes": (
        "frames:\n  tool: {parent: base_link, xyz: ['10 cm', 0, 0]}\n",
        (0.25, 0, 0),
        (0, 0, 0),
        "  tool: {parent: base_link, xyz: ['25 cm', 0, 0]}",
    ),
    "an angle in degrees": (
        "frames:\n  tool:\n    parent: base_link\n    rpy: [0, 15 deg, 0]  # down\n",
        (0, 0, 0),
        (0, 20, 0),
        "    rpy: [0, 20 deg, 0]  # down",
    ),
    "a direction becomes another": (
        "frames:\n  tool: {parent: base_link, look: down}\n",
        (0, 0, 0),
        (0, 0, 90),
        "  tool: {parent: base_link, look: left}",
    ),
    "a direction becomes angles": (
        "frames:\n  tool: {parent: base_link, look: down}\n",
        (0, 0, 0),
        (0, 80, 0),
        "  tool: {parent: base_link, look: {down: 80 deg}}",
    ),
    "an angle that is not there yet": (
        "frames:\n  tool: {parent: base_link, look: {down: 10 deg}}\n",
        (0, 0, 0),
        (0, 10, 30),
        "  tool: {parent: base_link, look: {down: 10 deg, left: 30 deg}}",
    ),
    "up stays up": (
        "frames:\n  tool: {parent: base_link, look: {up: 10 deg}}\n",
        (0, 0, 0),
        (0, -15, 0),
        "  tool: {parent: base_link, look: {up: 15 deg}}",
    ),
    "a position that is not there yet": (
        "frames:\n  tool: {parent: base_link}\n",
        (0.1, 0, 0),
        (0, 0, 0),
        "  tool: {parent: base_link, xyz: [0.1, 0, 0]}",
    ),
    "the axis stays": (
        "frames:\n  tool: {parent: base_link, axis_angle: {axis: [0, 0, 2], angle: 10 deg}}\n",
        (0, 0, 0),
        (0, 0, -30),
        "  tool: {parent: base_link, axis_angle: {axis: [0, 0, 2], angle: -30 deg}}",
    ),
    "what << brings is given anew": (
        "x-a: &a {rpy: [0, 10 deg, 0], parent: base_link}\nframes: {b: {<<: *a},\n  tool: {<<: *a, xyz: [0, 0, 1]}}\n",  # noqa: E501 (a text as its reader has it)
        (0, 0, 1),
        (0, 25, 0),
        "  tool: {<<: *a, xyz: [0, 0, 1], rpy: [0, 25 deg, 0]}}",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_one_line_changes(name: str) -> None:
    text, xyz, rpy, line = CASES[name]
    x, y, z = map(math.radians, rpy)
    assert changed_lines(
        BASE + text, moved(BASE + text, "tool", Pose(xyz, quat_from_rpy(x, y, z)))
    ) == [line]


def test_both_that_are_missing_are_one_edit() -> None:
    text = f"{BASE}frames:\n  tool:\n    parent: base_link  # the base\n  next: {{parent: tool}}\n"
    pose = Pose((0.1, 0.2, 0), quat_from_rpy(0, math.radians(10), 0))
    new = moved(text, "tool", pose)
    assert changed_lines(text, new) == ["    xyz: [0.1, 0.2, 0]", "    rpy: [0, 10 deg, 0]"]


def test_a_joint_keeps_the_offset_of_its_zero() -> None:
    text = f"{BASE}frames: {{tool: {{}}}}\njoints:\n  turn:\n    type: continuous\n"
    text += "    parent: base_link\n    child: tool\n    axis: [0, 0, 1]\n    offset: 10 deg\n"
    text += "    rpy: [90 deg, 0, 0]\n"
    mount = Pose((0, 0, 0), quat_from_rpy(math.radians(80), 0, 0))
    new = moved(text, "tool", mount @ Pose(quat_xyzw=quat_from_rpy(0, 0, math.radians(10))))
    assert changed_lines(text, new) == ["    rpy: [80 deg, 0, 0]"]


def test_a_profile_is_edited_where_it_stands() -> None:
    text = f"{BASE}frames:\n  tool: {{parent: base_link, xyz: [0, 0, 1]}}\n"
    text += "profiles:\n  tall:\n    frames: {tool: {xyz: [0, 0, 2]}}\n"
    new = moved(text, "tool", Pose((0, 0, 2.5)), ("tall",))
    assert changed_lines(text, new) == ["    frames: {tool: {xyz: [0, 0, 2.5]}}"]


#: A file, and what the reason names.
ELSEWHERE = {
    "a variable": (
        "vars: {h: 1 m}\nframes:\n  tool: {parent: base_link, xyz: [0, 0, '${h}']}\n",
        "${h}",
    ),
    "a variable in a rotation": (
        "vars: {a: 10 deg}\nframes:\n  tool: {parent: base_link, rpy: [0, '${2 * a}', 0]}\n",
        "a}",
    ),
    "an anchor": (
        "frames:\n  one: &one {parent: base_link, xyz: [0, 0, 1]}\n  tool: *one\n",
        "frames.one",
    ),
    "an anchor of a list": (
        "frames:\n  one: {parent: base_link, xyz: &p [0, 0, 1]}\n  tool: {parent: base_link, xyz: *p}\n",  # noqa: E501 (a text as its reader has it)
        "frames.one",
    ),
    "a preset": ("sensors:\n  tool: {preset: generic/camera, parent: base_link}\n", "preset"),
}


@pytest.mark.parametrize("name", ELSEWHERE)
@pytest.mark.parametrize(
    "overlay",
    ["", "frames:\n  other: {parent: base_link}\n", "frames: {other: {parent: base_link}}"],
)
def test_what_is_not_the_mounts_own_is_offered_in_an_overlay(name: str, overlay: str) -> None:
    text, reason = ELSEWHERE[name]
    child = "tool_optical_frame" if "sensors" in text else "tool"
    child = (
        child
        if child in robot_of(BASE + text).frames
        else robot_of(BASE + text).sensors[0].frames[0]
    )
    change = kept_elsewhere(
        BASE + text, overlay, child, Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3))
    )
    assert reason in change.reason


def test_an_entry_that_another_one_shares_gets_no_new_key() -> None:
    text = f"{BASE}frames:\n  one: &one {{parent: base_link}}\n  tool: *one\n"
    for pose in (Pose((1, 0, 0)), Pose(quat_xyzw=quat_from_rpy(0, 0.2, 0))):
        assert "frames.one" in kept_elsewhere(text, "", "tool", pose).reason


@pytest.mark.parametrize("profiles", [(), ("tall",)])
@pytest.mark.parametrize("values", [("&p [0, 0, 1]", "*p"), ("[0, 0, &h 1]", "[0, 0, *h]")])
def test_what_a_profile_shares_is_not_edited(
    values: tuple[str, str], profiles: tuple[str, ...]
) -> None:
    base_xyz, profile_xyz = values
    text = f"{BASE}frames:\n  tool: {{parent: base_link, xyz: {base_xyz}}}\n"
    text += f"profiles:\n  tall:\n    frames: {{tool: {{xyz: {profile_xyz}}}}}\n"
    done = compiled(text, profiles=profiles)
    assert done.robot
    change = change_of(done.robot, done.sources[0], {"r.yaml": text}, "tool", Pose((0, 0, 2)))
    assert isinstance(change, Elsewhere)
    assert "profiles.tall.frames.tool" in change.reason
    assert pose_in(robot_of(text, change.overlay("", "o.yaml"), profiles), "tool") == Pose(
        (0, 0, 2)
    )


def test_a_number_that_stays_may_be_computed() -> None:
    text = (
        f"{BASE}vars: {{h: 1 m}}\nframes:\n  tool: {{parent: base_link, xyz: [0, 0, '${{h}}']}}\n"
    )
    new = moved(text, "tool", Pose((0.5, 0, 1)))
    assert changed_lines(text, new) == ["  tool: {parent: base_link, xyz: [0.5, 0, '${h}']}"]


def test_what_another_node_publishes_cannot_be_moved() -> None:
    text = f"{BASE}processes: {{slam: {{external: true}}}}\n"
    text += "frames: {map: {}, base_link: {parent: map, owner: slam}}\n"
    done = compiled(text)
    assert done.robot
    with pytest.raises(ImmovableError, match="slam"):
        change_of(done.robot, done.sources[0], {"r.yaml": text}, "base_link", Pose((1, 0, 0)))
    with pytest.raises(ImmovableError, match="root"):
        change_of(done.robot, done.sources[0], {"r.yaml": text}, "map", Pose((1, 0, 0)))


@pytest.mark.parametrize("file", sorted(ROBOTS.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_mount_of_the_gallery_moves_or_says_why_not(file: Path) -> None:
    text = file.read_text("utf-8")
    done = compiled(text, file=f"robots/{file.name}")
    assert done.robot
    chance = random.Random(file.name)
    for edge in done.robot.edges:
        pose = Pose(
            tuple(value + chance.uniform(-0.1, 0.1) for value in edge.pose.xyz),  # type: ignore[arg-type]
            normalise(
                quat_from_rpy(
                    *(
                        angle + chance.uniform(-0.3, 0.3)
                        for angle in rpy_from_quat(edge.pose.quat_xyzw)
                    )
                )
            ),
        )
        try:
            change = change_of(
                done.robot, done.sources[0], {f"robots/{file.name}": text}, edge.child, pose
            )
        except ImmovableError:
            continue
        if isinstance(change, Elsewhere):
            if not change.entry:
                continue
            overlay = change.overlay("", "o.yaml")
            after = compiled(text, overlay, file=f"robots/{file.name}")
        else:
            new = apply_edits(text, change.edits)
            assert new is not None
            after = compiled(new, file=f"robots/{file.name}")
        assert after.robot
        off = offset_of(pose, pose_in(after.robot, edge.child))
        assert off.xyz_m < 1e-6, (edge.name, change)
        assert off.rot_rad < 1e-6, (edge.name, change)
