"""Rays against bodies: trimesh is the oracle for primitives, primitives for meshes."""

import math
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.texts import robot_in
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.rays import (
    PosedShape,
    Surroundings,
    View,
    cast,
    contains,
    directions,
    view_of,
)
from tfcompose.compiler.rays.bundle import bundle_of
from tfcompose.foundation.findings import Span
from tfcompose.foundation.geometry import Pose, matrix_from_quat, normalise, quat_from_rpy
from tfcompose.model.robot import Asset, Optics, Robot, Shape
from tfcompose.tools.view.shapes import mesh_of

HEAD = "tfcompose: 1\nrobot: r\n"
SIZES = {"box": (0.6, 0.4, 0.2), "sphere": (0.3,), "cylinder": (0.2, 0.5), "capsule": (0.15, 0.4)}
DEGREE = math.pi / 180
CAMERA = Optics(
    "image", "c", "camera", Span("r.yaml"), horizontal=(-0.6, 0.6), vertical=(-0.4, 0.4)
)
SCAN = Optics(
    "scan", "s", "lidar", Span("r.yaml"), horizontal=(-math.pi, math.pi), vertical=(0.0, 0.0)
)

ShapeKind = Literal["box", "sphere", "cylinder", "capsule"]
KINDS_OF_SHAPES: list[ShapeKind] = ["box", "sphere", "cylinder", "capsule"]
angles = st.floats(-math.pi, math.pi)
metres = st.floats(-2, 2)


def of_trimesh(kind: str) -> Any:
    size = SIZES[kind]
    match kind:
        case "box":
            return trimesh.creation.box(size)
        case "sphere":
            return trimesh.creation.icosphere(4, size[0])
        case "cylinder":
            return trimesh.creation.cylinder(size[0], size[1], sections=256)
    mesh = trimesh.creation.capsule(size[1], size[0], count=(96, 96))
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


MESHES = {kind: of_trimesh(kind) for kind in SIZES}


def transform(pose: Pose) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = matrix_from_quat(pose.quat_xyzw), pose.xyz
    return made


@settings(max_examples=25, deadline=None)
@given(
    kind=st.sampled_from(KINDS_OF_SHAPES),
    xyz=st.tuples(metres, metres, metres),
    rpy=st.tuples(angles, angles, angles),
)
def test_a_ray_ends_where_trimesh_says(
    kind: ShapeKind, xyz: tuple[float, float, float], rpy: tuple[float, float, float]
) -> None:
    pose = Pose(xyz, quat_from_rpy(*rpy))
    mesh = MESHES[kind].copy()
    mesh.apply_transform(transform(pose))
    into = directions(SCAN)[::7] + directions(CAMERA)[::11]
    view = cast("s", SCAN, into, [PosedShape("b", Shape(kind, SIZES[kind], pose), pose)])
    if mesh.contains([[0, 0, 0]])[0]:
        near: Any = trimesh.proximity
        assert view.inside or abs(near.signed_distance(mesh, [[0, 0, 0]])[0]) < 1e-3
        return
    where, index, _ = mesh.ray.intersects_location(np.zeros((len(into), 3)), np.asarray(into))
    expected = np.full(len(into), np.inf)
    np.minimum.at(expected, index, np.linalg.norm(where, axis=1))
    distances = np.array([ray.distance for ray in view.rays])
    both = np.isfinite(expected) & np.isfinite(distances)
    grazing = np.isfinite(expected) != np.isfinite(
        distances
    )  # the mesh is a polyhedron inside the round shape
    assert grazing.sum() <= 2
    steep = np.abs(distances[both] - expected[both]) > 5e-3
    assert steep.sum() <= 2


@settings(max_examples=50, deadline=None)
@given(
    places=st.lists(st.tuples(metres, metres, metres), min_size=1, max_size=12),
    rpy=st.tuples(angles, angles, angles),
    optics=st.sampled_from([SCAN, CAMERA]),
)
def test_a_ray_ends_at_the_nearest_of_all_bodies(
    places: list[tuple[float, float, float]],
    rpy: tuple[float, float, float],
    optics: Optics,
) -> None:
    bodies = [
        PosedShape(f"b{n}", Shape(kind, SIZES[kind], Pose()), Pose(xyz, quat_from_rpy(*rpy)))
        for n, (kind, xyz) in enumerate(zip(KINDS_OF_SHAPES * 3, places, strict=False))
    ]
    into = directions(optics)
    together = cast("s", optics, into, bodies)
    each = [cast("s", optics, into, [body]).hits for body in bodies]
    for index in range(len(into)):
        hits = [hit[index] for hit in each if index in hit]
        assert together.hits.get(index) == min(hits, key=lambda hit: hit[0], default=None)


@given(xyz=st.tuples(metres, metres, metres), radius=st.floats(0, 1))
@pytest.mark.parametrize("optics", [SCAN, CAMERA])
def test_a_bundle_leaves_out_no_ray_that_meets_a_sphere(
    optics: Optics, xyz: tuple[float, float, float], radius: float
) -> None:
    into = directions(optics)
    near = {index for index, _ in bundle_of(into).rays_near(*xyz, radius)}
    square = sum(value * value for value in xyz)
    for index, direction in enumerate(into):
        along = sum(a * b for a, b in zip(direction, xyz, strict=True))
        meets = square - max(0.0, along) ** 2 <= radius**2
        assert index in near or not meets


def test_a_body_around_the_origin_says_how_deep_that_is() -> None:
    box = PosedShape("b", Shape("box", (1.0, 2.0, 3.0), Pose()), Pose((0.2, 0.0, 0.0)))
    view = cast("s", SCAN, directions(SCAN), [box])
    assert view.inside == {"b": pytest.approx(0.3)}
    assert view.blocked == 0


@pytest.mark.parametrize("kind", KINDS_OF_SHAPES)
def test_a_body_that_a_sensor_is_mounted_flush_on_blocks_nothing(kind: ShapeKind) -> None:
    size = SIZES[kind]
    surface = size[0] / 2 if kind == "box" else size[0]
    flush = PosedShape("b", Shape(kind, size, Pose()), Pose((-surface, 0.0, 0.0)))
    assert cast("s", SCAN, directions(SCAN), [flush]).blocked == 0


def robot_of(text: str) -> Robot:
    return robot_in(compile_robot(HEAD + text, "r.yaml", library(), read=read_text, disk=disk()))


def view(text: str) -> View:
    robot = robot_of(text)
    return view_of(Surroundings(robot), robot.sensors[0], robot.sensors[0].optics[0])


def test_a_wall_over_the_left_half_blocks_half_the_image() -> None:
    result = view(
        "links: {base_link: {}, wall: {parent: base_link, xyz: [2, 5, 0], visual: {box: [0.1, 10,"
        " 20]}}}\nsensors: {c: {preset: generic/camera, parent: base_link, optics: {image:"
        " {horizontal: 80 deg, vertical: 60 deg}}}}\n"
    )
    assert result.blocked == pytest.approx(0.5)
    assert result.blocking == ("wall",)
    assert min(ray.distance for ray in result.rays) == pytest.approx(1.95, rel=0.01)


def test_a_pole_blocks_the_sector_that_it_fills() -> None:
    result = view(
        "links: {base_link: {}, pole: {parent: base_link, xyz: [1, 0, 0], visual: {cylinder:"
        " {radius: 0.5, length: 1}}}}\nsensors: {s: {preset: generic/lidar2d, parent: base_link,"
        " optics: {scan: {horizontal: 360 deg}}}}\n"
    )
    assert sum(ray.link == "pole" for ray in result.rays) == 60  # twice the arc sine of a half
    assert len(result.rays) == 360


def test_what_is_beyond_the_range_blocks_nothing() -> None:
    text = (
        "links: {base_link: {}, wall: {parent: base_link, xyz: [2, 0, 0], visual: {box: [0.1, 10,"
        " 20]}}}\nsensors: {c: {preset: generic/camera, parent: base_link, optics: {image:"
        " {horizontal: 80 deg, vertical: 60 deg, far: %s}}}}\n"
    )
    assert (view(text % 1).blocked, view(text % 10).blocked) == (0, 1)


def test_an_arm_that_moves_blocks_nothing_and_a_wheel_does() -> None:
    text = (
        "links: {base_link: {}, body: {visual: {box: [0.1, 10, 20]}}}\njoints: {j: {type: %s,"
        " parent: base_link, child: body, xyz: [2, 0, 0], limit: {lower: 0, upper: 1, effort: 1,"
        " velocity: 1}}}\nsensors: {c: {preset: generic/camera, parent: base_link, optics: {image:"
        " {horizontal: 80 deg, vertical: 60 deg}}}}\n"
    )
    assert view(text % "revolute").blocked == 0
    assert (
        view(
            text.replace(", limit: {lower: 0, upper: 1, effort: 1, velocity: 1}", "")
            % "continuous"
        ).blocked
        == 1
    )


def test_a_mesh_is_hit_where_the_same_primitive_is(tmp_path: Path) -> None:
    file = tmp_path / "ball.stl"
    MESHES["sphere"].export(file)
    pose = Pose((1.0, 0.2, 0.1), normalise((0.1, 0.2, 0.3, 0.9)))
    shape = Shape("mesh", (2.0, 2.0, 2.0), pose, mesh=Asset("ball.stl", path=str(file)))
    by_mesh = cast("s", SCAN, directions(CAMERA), [PosedShape("b", shape, pose)])
    by_shape = cast(
        "s", SCAN, directions(CAMERA), [PosedShape("b", Shape("sphere", (0.6,), pose), pose)]
    )
    assert by_mesh.inside == by_shape.inside == {}
    turned = [Pose((0.9, 0.2, 0.1)), Pose((0.1, 0.0, 0.0))]
    assert cast("s", SCAN, (), [PosedShape("b", shape, turned[1])]).inside["b"] == pytest.approx(
        0.5, abs=0.01
    )
    for ray, twin in zip(by_mesh.rays, by_shape.rays, strict=True):
        if math.isfinite(ray.distance) and math.isfinite(twin.distance):
            assert ray.distance == pytest.approx(twin.distance, abs=0.02)


@pytest.mark.filterwarnings(
    "ignore:Setting the shape on a NumPy array:DeprecationWarning"
)  # of pycollada's writer
def test_a_collada_file_is_in_its_own_unit_here_and_in_the_view(tmp_path: Path) -> None:
    file = tmp_path / "box.dae"
    text = trimesh.creation.box((2, 2, 2)).export(file_type="dae").decode()
    file.write_text(
        text.replace("<asset>", '<asset><unit name="centimeter" meter="0.01"/>'), "utf-8"
    )
    shape = Shape("mesh", (10.0, 10.0, 10.0), Pose(), mesh=Asset("box.dae", path=str(file)))
    result = cast("s", SCAN, ((1.0, 0.0, 0.0),), [PosedShape("b", shape, Pose((1.0, 0.0, 0.0)))])
    assert result.rays[0].distance == pytest.approx(0.9)
    assert mesh_of(shape).extents == pytest.approx([0.2, 0.2, 0.2])


def test_a_mesh_that_cannot_be_read_blocks_nothing_and_is_named(tmp_path: Path) -> None:
    shape = Shape(
        "mesh", (1.0, 1.0, 1.0), Pose(), mesh=Asset("none.stl", path=str(tmp_path / "none.stl"))
    )
    result = cast("s", SCAN, directions(SCAN), [PosedShape("b", shape, Pose((1.0, 0, 0)))])
    assert (result.blocked, result.left_out) == (0, ("b",))


KINDS = [
    CAMERA,
    SCAN,
    Optics(
        "f", "c", "camera", Span("r"), projection="fisheye", diagonal=163 * DEGREE, backward=True
    ),
    Optics(
        "b", "c", "camera", Span("r"), horizontal=(-0.5, 0.7), vertical=(-0.3, 0.1), backward=True
    ),
    Optics("l", "s", "lidar", Span("r"), horizontal=(-2.0, 2.5), vertical=(-0.1, 0.9)),
    Optics(
        "e",
        "s",
        "lidar",
        Span("r"),
        horizontal=(0.0, math.tau),
        vertical=(-0.3, 0.2),
        elevations=(-0.3, 0.1, 0.2),
    ),
    Optics("u", "s", "ultrasonic", Span("r"), horizontal=(-0.2, 0.2), vertical=(-0.2, 0.2)),
]


@pytest.mark.parametrize("optics", KINDS, ids=lambda ray: ray.stream)
def test_every_ray_is_a_unit_vector_in_view_and_its_opposite_is_not(
    optics: Optics,
) -> None:
    into = directions(optics)
    assert len(into) > 100
    for x, y, z in into:
        assert math.hypot(x, y, z) == pytest.approx(1)
        assert contains(optics, (x, y, z))
        full_circle = optics.horizontal and optics.horizontal[1] - optics.horizontal[0] > math.pi
        assert full_circle or not contains(optics, (-x, -y, -z))


def test_a_camera_views_along_z_and_other_sensors_along_x() -> None:
    middle = np.mean(directions(CAMERA), axis=0)
    assert middle == pytest.approx([0, 0, middle[2]], abs=1e-9)
    assert middle[2] > 0.8
    backward = np.mean(directions(KINDS[2]), axis=0)
    assert backward[2] < -0.3
    left_and_up = Optics("o", "c", "camera", Span("r"), horizontal=(0.1, 0.7), vertical=(0.1, 0.3))
    assert all(x < 0 and y < 0 and z > 0 for x, y, z in directions(left_and_up))
    scanner = Optics("o", "s", "lidar", Span("r"), horizontal=(0.1, 0.7), vertical=(0.1, 0.3))
    assert all(x > 0 and y > 0 and z > 0 for x, y, z in directions(scanner))


def test_what_is_not_known_has_no_rays() -> None:
    assert directions(Optics("o", "c", "camera", Span("r"), horizontal=(-1, 1))) == ()
    assert directions(Optics("o", "s", "lidar", Span("r"), vertical=(-1, 1))) == ()
    assert directions(Optics("o", "c", "camera", Span("r"), projection="fisheye")) == ()


def test_lint_of_primitives_loads_neither_numpy_nor_trimesh(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(
        HEAD + "links: {base_link: {visual: {box: [1, 1, 1]}}}\n"
        "sensors: {c: {preset: realsense/d435, parent: base_link, xyz: [1, 0, 1]}}\n"
    )
    code = (
        "import sys; from tfcompose.cli.parser import main\n"
        f"try: main(['lint', {str(file)!r}])\nexcept SystemExit: pass\n"
        "assert not {'numpy', 'trimesh'} & sys.modules.keys()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
