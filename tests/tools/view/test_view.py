"""The view: moving joints and mounts, saving one line, one HTML file, a clean end."""

import json
import math
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Mapping
from pathlib import Path

import pytest
import trimesh
import viser

from tests.support import processes
from tests.support.browser import page_of
from tests.support.cli import tfcompose_in
from tests.support.scenes import body_pose
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.fixing import ChangedError, rewrite
from tfcompose.cli.parser import parser_of
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.geometry import Pose, offset_of, quat_from_rpy
from tfcompose.model.plan.file import read_plan
from tfcompose.tools.view import command
from tfcompose.tools.view.camera import begin_at
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.plan_robot import robot_of_plan
from tfcompose.tools.view.scene import RobotScene, colours_of
from tfcompose.tools.view.session import Session
from tfcompose.tools.view.shapes import MOST_TRIANGLES

ROVER = Path(__file__).parents[3] / "robots" / "field_rover.yaml"
PRESETS = library()


def session_of(file: Path) -> Session:
    def compiled(texts: Mapping[str, str]) -> Compiled:
        return compile_robot(texts[str(file)], str(file), PRESETS)

    return Session(
        {str(file): file.read_text("utf-8")},
        compiled,
        lambda path, old, new: rewrite(Path(path), old, new),
    )


def test_a_moved_mount_is_saved_as_one_line_and_its_comment_stays(
    rover: Path, server: viser.ViserServer
) -> None:
    before = rover.read_text("utf-8").splitlines()
    session = session_of(rover)
    panel = Panel(server, session, edit=True)
    panel.tree.select("front_link")
    mount = session.mount("front_link")
    pose = mount.pose_in_file(mount.edge.pose)
    panel.move(Pose((0.5, *pose.xyz[1:]), pose.quat_xyzw))
    panel.save()
    after = rover.read_text("utf-8").splitlines()
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert changed == [
        (
            "    xyz: [0.48, 0.0475, 0.30]         # so the camera's middle is in the rover's",
            "    xyz: [0.5, 0.0475, 0.30]         # so the camera's middle is in the rover's",
        )
    ]
    assert "+    xyz: [0.5," in panel.report.content
    assert not session.moved


def test_undo_and_redo_lead_back_and_forth(rover: Path) -> None:
    session = session_of(rover)
    mount = session.mount("front_link").edge
    old = mount.pose
    session.move(mount.child, Pose((1, 0, 0)))
    session.move(mount.child, Pose((2, 0, 0)))
    assert session.undo()
    assert session.mount("front_link").edge.pose == Pose((1, 0, 0))
    assert session.undo()
    assert session.mount("front_link").edge.pose == old
    assert not session.undo()
    assert session.redo()
    assert session.redo()
    assert session.mount("front_link").edge.pose == Pose((2, 0, 0))
    assert not session.redo()


def test_the_gizmo_is_where_a_typed_pose_puts_the_mount(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=True)
    panel.tree.select("front_link")
    pose = panel.session.mount("front_link").pose_in_file(
        panel.session.mount("front_link").edge.pose
    )
    panel.move(Pose((0.5, 0.1, 0.7), pose.quat_xyzw))
    assert panel.gizmo.position == pytest.approx(panel.poses()["front_link"].xyz)
    assert panel.poses()["front_link"].xyz == pytest.approx((0.5, 0.1, 0.7))


def test_undo_and_redo_lead_over_a_save(rover: Path) -> None:
    session, text = session_of(rover), rover.read_text("utf-8")
    child, second_frame = (
        session.mount(frame).edge.child for frame in ("front_link", "rear_link")
    )
    first, second = (session.mount(frame).edge.pose for frame in (child, second_frame))
    session.move(child, Pose((1, 0, 0)))
    session.move(second_frame, Pose((2, 0, 0)))
    assert session.save().diff
    session.move(second_frame, Pose((3, 0, 0)))
    for pose, expected in (
        (Pose((1, 0, 0)), Pose((2, 0, 0))),
        (Pose((1, 0, 0)), second),
        (first, second),
    ):
        assert session.undo()
        assert close(session.mount(child).edge.pose, pose)
        assert close(session.mount(second_frame).edge.pose, expected)
    assert not session.undo()
    assert session.save().diff
    assert rover.read_text("utf-8").replace("0.3]", "0.30]") == text
    for _ in range(3):
        assert session.redo()
    assert close(session.mount(child).edge.pose, Pose((1, 0, 0)))
    assert close(session.mount(second_frame).edge.pose, Pose((3, 0, 0)))


def close(pose: Pose, expected: Pose) -> bool:
    """Return whether two poses are the same to a micrometre and a microradian."""
    return max(offset_of(pose, expected)) < 1e-6


def test_what_a_variable_gives_is_not_saved_and_an_overlay_is_offered(rover: Path) -> None:
    session, text = session_of(rover), rover.read_text("utf-8")
    mount = session.mount("lidar_base_link") if "lidar_base_link" in session.robot.frames else None
    child = (
        mount.edge.child
        if mount
        else next(sensor.mount for sensor in session.robot.sensors if sensor.name == "lidar")
    )
    session.move(child, Pose((0.1, 0, 1.5)))
    saved = session.save()
    assert rover.read_text("utf-8") == text
    assert "${0.2475 + mast}" in saved.elsewhere[0].reason
    assert (
        saved.elsewhere[0].overlay("", "o.yaml") == "sensors:\n  lidar:\n    xyz: [0.1, 0, 1.5]\n"
    )
    assert session.moved


def test_a_file_that_somebody_else_changed_is_not_overwritten(rover: Path) -> None:
    session = session_of(rover)
    session.move(session.mount("front_link").edge.child, Pose((1, 0, 0)))
    rover.write_text("# another text\n", "utf-8")
    with pytest.raises(ChangedError):
        session.save()
    assert rover.read_text("utf-8") == "# another text\n"


def test_a_slider_moves_the_body_of_a_wheel(rover: Path, server: viser.ViserServer) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    before = body_pose(panel.scene, "front_left_wheel_link")
    panel.set_joint("front_left_wheel_joint", math.radians(30))
    expected = before @ Pose(quat_xyzw=quat_from_rpy(0, 0, math.radians(30)))
    off = offset_of(expected, body_pose(panel.scene, "front_left_wheel_link"))
    assert off.xyz_m < 1e-6
    assert off.rot_rad < 1e-6
    assert body_pose(panel.scene, "front_right_wheel_link").xyz != before.xyz


def test_a_mimic_joint_follows() -> None:
    text = """tfcompose: 1
robot: r
links: {a: {}, b: {}, c: {}}
joints:
  one: {type: prismatic, parent: a, child: b, axis: [1, 0, 0], limit: {lower: 0, upper: 1, effort: 1, velocity: 1}}
  two: {type: prismatic, parent: a, child: c, axis: [0, 1, 0], limit: {lower: -1, upper: 1, effort: 1, velocity: 1},
        mimic: {joint: one, multiplier: -2, offset: 0.1}}
"""  # noqa: E501 (a text as its reader has it)
    robot = compile_robot(text, "r.yaml", PRESETS).robot
    assert robot
    poses = poses_in_roots(robot, {"one": 0.25})
    assert poses["b"].xyz == (0.25, 0, 0)
    assert poses["c"].xyz == (0, -0.4, 0)


def test_no_owner_has_the_red_of_wrong_edges() -> None:
    frames = "".join(f"  f{n}: {{parent: base, owner: o{n}, rate: 1 Hz}}\n" for n in range(100))
    owners = "".join(f"  o{n}: {{external: true, node: n{n}}}\n" for n in range(100))
    text = f"tfcompose: 1\nrobot: r\nframes:\n  base: {{}}\n{frames}processes:\n{owners}"
    robot = compile_robot(text, "r.yaml", PRESETS).robot
    assert robot
    colours = colours_of(robot)
    assert len(set(colours.values())) == 100
    assert not [
        owner
        for owner, (red, green, blue) in colours.items()
        if red > 150 and green < 80 and blue < 80
    ]


def test_html_is_one_small_file(rover: Path) -> None:
    done = tfcompose_in(rover.parent, "view", rover.name, "--html", "rover.html")
    assert (done.returncode, done.stdout) == (0, "")
    page = (rover.parent / "rover.html").read_text("utf-8")
    assert len(page) < 100_000
    assert "<title>field_rover</title>" in page
    assert "odom is a root (field_rover.yaml:34:3)" in page
    assert "100, 0, 797.5 mm" in page


def test_names_in_a_page_are_text_and_its_frames_open_in_a_browser(tmp_path: Path) -> None:
    name = "<b onclick='x()'>&\""
    text = (
        f"tfcompose: 1\nrobot: r\nframes: {{base: {{}}, {json.dumps(name)}: {{parent: base, xyz:"
        " [0.25, 0, 0]}}\n"
    )
    (tmp_path / "r.yaml").write_text(text, "utf-8")
    assert tfcompose_in(tmp_path, "view", "r.yaml", "--html", "r.html").returncode == 0
    with page_of((tmp_path / "r.html").as_uri()) as page:
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        page.locator("summary").get_by_text(name, exact=True).click()
        page.locator("#about").get_by_text("250, 0, 0 mm").wait_for()
        page.locator("canvas").first.wait_for()
        assert not [url for url in requests if url.startswith("http")]


@pytest.mark.parametrize(
    "words", [("--html", "none/r.html"), ("--html", "."), ("--html", "./field_rover.yaml")]
)
def test_a_refused_page_changes_nothing(rover: Path, words: tuple[str, ...]) -> None:
    done = tfcompose_in(rover.parent, "view", rover.name, *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].startswith("tfcompose: ")
    assert words[1] in done.stderr or Path(words[1]).name in done.stderr
    assert rover.read_bytes() == ROVER.read_bytes()


def test_a_robot_without_frames_is_refused(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text("tfcompose: 1\nrobot: r\n", "utf-8")
    done = tfcompose_in(tmp_path, "view", "r.yaml", "--html", "r.html")
    assert done.returncode == 1
    assert "TF206" in done.stderr
    assert "Traceback" not in done.stderr


WRONG = {
    "a child that is not there": (
        "links: {base_link: {}, arm: {parent: base_link, xyz: [1, 0, 0]}}\n"
        "joints: {j: {type: continuous, parent: base_link, child: amr, axis: [0, 0, 1]}}"
    ),
    "limits the wrong way round": (
        "links: {base_link: {}, arm: {}}\njoints: {j: {type: revolute, parent: base_link,"
        " child: arm, axis: [0, 0, 1], limit: {lower: 1, upper: -1, effort: 1, velocity: 1}}}"
    ),
    "an unknown unit": (
        "links: {base_link: {}, arm: {parent: base_link, xyz: [1 metre, 0, 0], rpy: [0, 1 degr,"
        " 0]}}"
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_robot_is_shown_and_its_mounts_move(
    name: str, tmp_path: Path, server: viser.ViserServer
) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(f"tfcompose: 1\nrobot: r\n{WRONG[name]}\n", "utf-8")
    session = session_of(file)
    assert session.state.errors
    panel = Panel(server, session, edit=True)
    panel.tree.select("arm")
    panel.move(Pose((3, 0, 0), quat_from_rpy(0, 0.5, 0)))
    panel.save()
    assert panel.report.content


@pytest.mark.parametrize("port", [-1, 65_536])
def test_a_port_that_does_not_exist_is_refused(rover: Path, port: int) -> None:
    done = tfcompose_in(rover.parent, "view", rover.name, f"--port={port}")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"tfcompose: port {port}")


def test_the_camera_begins_outside_the_robot_and_the_grid_is_below_it(
    server: viser.ViserServer,
) -> None:
    text = """tfcompose: 1
robot: r
links: {base_link: {}, car: {parent: base_link, xyz: [2, 0, 0.5], visual: {box: [4, 2, 2]}}}
"""
    robot = compile_robot(text, "r.yaml", PRESETS).robot
    assert robot
    begin_at(server, RobotScene(server.scene, robot).add_grid(poses_in_roots(robot, {})))
    camera = server.initial_camera
    assert camera.look_at == pytest.approx([2, 0, 0.5])
    assert math.dist(camera.position, camera.look_at) > math.hypot(2, 1, 1)
    grid = server.scene.get_handle_by_name("/grid")
    assert grid
    assert grid.position[2] == pytest.approx(-0.5)


HEAVY = """tfcompose: 1
robot: r
links:
  base_link: {visual: {mesh: heavy.stl}}
  arm: {parent: base_link, xyz: [1, 0, 0], visual: {mesh: heavy.stl}, collision: [{box: [2, 2, 2]}]}
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.parametrize(("side_m", "scale"), [(0.25, 0.5), (1.0, 1.0), (4.0, 2.0)])
def test_axes_and_fields_of_view_grow_with_the_robot(
    server: viser.ViserServer, side_m: float, scale: float
) -> None:
    text = (
        f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{visual: {{box: [{side_m}, 0.1,"
        " 0.1]}}}\n"
    )
    robot = compile_robot(text, "r.yaml", library()).robot
    assert robot
    scene = RobotScene(server.scene, robot)
    scene.update(robot, poses_in_roots(robot, {}))
    assert server.scene.get_handle_by_name("/frames").axes_length == pytest.approx(0.08 * scale)  # type: ignore[union-attr]
    assert (scene.scale, scene.fields.reach) == (scale, 0.5 * scale)


def test_a_mesh_has_few_triangles_and_visuals_follow_collision_shapes(
    tmp_path: Path, server: viser.ViserServer
) -> None:
    trimesh.creation.icosphere(subdivisions=6).export(tmp_path / "heavy.stl")
    robot = compile_robot(HEAVY, str(tmp_path / "r.yaml"), PRESETS, disk=disk()).robot
    assert robot
    scene = RobotScene(server.scene, robot)
    heavy = server.scene.get_handle_by_name("/body/0/first/0")
    assert isinstance(heavy, viser.MeshHandle)
    assert 0.9 * MOST_TRIANGLES < len(heavy.faces) <= MOST_TRIANGLES
    extent = heavy.vertices.max(axis=0) - heavy.vertices.min(axis=0)
    assert extent == pytest.approx([2.0, 2.0, 2.0], abs=0.01)
    box = server.scene.get_handle_by_name("/body/1/first/0")
    assert isinstance(box, viser.MeshHandle)
    assert len(box.faces) == 12
    scene.add_meshes()
    assert server.scene.get_handle_by_name("/body/1/first/0") is None
    later = server.scene.get_handle_by_name("/body/1/visual/0")
    assert isinstance(later, viser.MeshHandle)
    assert len(later.faces) == len(heavy.faces)


def test_a_scene_that_has_ended_gets_no_meshes(tmp_path: Path, server: viser.ViserServer) -> None:
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "heavy.stl")
    robot = compile_robot(HEAVY, str(tmp_path / "r.yaml"), PRESETS, disk=disk()).robot
    assert robot
    scene = RobotScene(server.scene, robot)
    scene.end()
    scene.add_meshes()
    assert server.scene.get_handle_by_name("/body/1/visual/0") is None


def test_the_server_answers_until_ctrl_c_and_a_taken_port_names_the_next(rover: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = tfcompose_in(rover.parent, "view", rover.name, "--port", str(port))
        assert done.returncode == 2
        assert f"port {port} is taken; --port " in done.stderr
    command = [sys.executable, "-m", "tfcompose", "view", rover.name, "--port", str(port)]
    running = processes.start(command, cwd=rover.parent, stdout=subprocess.PIPE)
    try:
        assert running.stdout
        address = running.stdout.readline().strip()
        with urllib.request.urlopen(address, timeout=30) as answer:  # noqa: S310 (on this machine)
            assert answer.status == 200
        running.send_signal(signal.SIGINT)
        assert running.wait(30) == 130
    finally:
        processes.end(running)


def test_a_mount_inside_a_part_cannot_be_saved_here_and_stays_moved() -> None:
    file = ROVER.with_name("two_rovers.yaml")
    text = file.read_text("utf-8")

    def compiled(texts: Mapping[str, str]) -> Compiled:
        return compile_robot(
            texts[str(file)], str(file), PRESETS, read=lambda path: Path(path).read_text("utf-8")
        )

    session = Session({str(file): text}, compiled, lambda *_: pytest.fail("something was written"))
    assert session.state.robot
    child = next(
        edge.child
        for edge in session.state.robot.edges
        if edge.child.startswith("rover1/") and edge.kind == "static"
    )
    session.move(child, Pose((1, 2, 3)))
    (elsewhere,) = session.save().elsewhere
    assert f"view {file.with_name('rover.yaml')} --edit" in elsewhere.reason
    assert session.moved == {child: Pose((1, 2, 3))}


def test_a_built_plan_is_shown_with_its_bodies_and_frames(rover: Path) -> None:
    assert tfcompose_in(rover.parent, "build", rover.name, "--output", "out").returncode == 0
    done = tfcompose_in(rover.parent, "view", "out", "--html", "rover.html")
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    plan = read_plan((rover.parent / "out" / "plan.json").read_text("utf-8"), "plan.json")
    urdf = (rover.parent / "out" / plan.description).read_text("utf-8")
    robot = robot_of_plan(plan, urdf, "robot.urdf", Packages().asset)
    expected = session_of(rover).robot
    assert robot.frames.keys() == expected.frames.keys()
    bodies = {frame for frame, link in robot.links.items() if link.visuals or link.collisions}
    assert bodies == {
        frame for frame, link in expected.links.items() if link.visuals or link.collisions
    }
    planned, compiled = poses_in_roots(robot, {}), poses_in_roots(expected, {})
    assert all(max(offset_of(compiled[frame], pose)) < 1e-9 for frame, pose in planned.items())
    limits = {edge.joint.name: edge.joint.limit for edge in expected.edges if edge.joint}
    assert {edge.joint.name: edge.joint.limit for edge in robot.edges if edge.joint} == limits


def test_an_address_that_is_not_this_machines_is_refused(rover: Path) -> None:
    done = tfcompose_in(rover.parent, "view", rover.name, "--host", "192.0.2.1")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(
        "tfcompose: --host 192.0.2.1 is not an address of this machine"
    )


def test_a_built_plan_is_not_edited(rover: Path) -> None:
    assert tfcompose_in(rover.parent, "build", rover.name, "--output", "out").returncode == 0
    done = tfcompose_in(rover.parent, "view", "out/plan.json", "--edit")
    assert done.returncode == 2
    assert "built plan" in done.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("--live", "--html", "r.html"),
        ("--bag", "run", "--html", "r.html"),
        ("--bag", "run", "--edit"),
    ],
)
def test_published_trees_give_no_page_and_a_recording_is_not_edited(
    rover: Path, options: tuple[str, ...]
) -> None:
    done = tfcompose_in(rover.parent, "view", rover.name, *options)
    assert done.returncode == 2
    assert done.stderr.startswith(f"tfcompose: {options[0]}")
    assert not (rover.parent / "r.html").exists()


def test_without_ros_nothing_is_served_live(rover: Path) -> None:
    done = tfcompose_in(
        rover.parent,
        "view",
        rover.name,
        "--live",
        "--port",
        "0",
        RMW_IMPLEMENTATION="rmw_of_nobody",
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "[TF901]" in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ["--at", "3"],
        ["--at", "0"],
        ["--html", "r.html", "--edit"],
        ["--tolerance", "2mm"],
    ],
)
def test_an_option_without_what_it_is_for_is_refused(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_bytes(ROVER.read_bytes())
    done = tfcompose_in(tmp_path, "view", "r.yaml", "--port", "0", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"tfcompose: {words[0]} ")
    assert not (tmp_path / "r.html").exists()


def test_ctrl_c_during_scene_creation_ends_the_view_without_an_error(
    monkeypatch: pytest.MonkeyPatch, rover: Path
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tfcompose.tools.view.windows.Windows", interrupted)
    arguments = parser_of("view").parse_args([str(rover), "--port", "0"])
    with pytest.raises(KeyboardInterrupt):
        command.run(arguments)
