"""Masses and moments of inertia, against scipy, trimesh and pinocchio."""

import json
import math
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from tfcompose.cli.compiling import disk, library
from tfcompose.compiler.compile import compile_robot
from tfcompose.model.robot import Inertial

PRESETS = library()
sizes = st.floats(0.01, 5)


def inertial_of(body: dict[str, Any], folder: Path | None = None) -> Inertial:
    """Return the inertia that the robot has of a link."""
    text = json.dumps({"tfcompose": 1, "robot": "r", "links": {"base_link": body}})
    file = f"{folder}/r.yaml" if folder else "r.yaml"
    compiled = compile_robot(text, file, PRESETS, disk=disk() if folder else None)
    assert not compiled.errors, compiled.errors
    assert compiled.robot
    inertial = compiled.robot.links["base_link"].inertial
    assert inertial
    return inertial


def matrix(inertial: Inertial) -> Any:
    xx, xy, xz, yy, yz, zz = inertial.tensor
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def revolved(
    radius: Callable[[float], float], low: float, high: float, breaks: list[float]
) -> tuple[float, Any]:
    """Return volume and principal moments about the origin of a solid of revolution.

    The axis is z; the solid is integrated by its slices.
    """

    def integral(of: Callable[[float], float]) -> float:
        return float(quad(of, low, high, points=breaks, epsabs=1e-14, epsrel=1e-12, limit=400)[0])

    volume = integral(lambda z: math.pi * radius(z) ** 2)
    along = integral(lambda z: math.pi * radius(z) ** 4 / 2)
    across = integral(lambda z: math.pi * radius(z) ** 4 / 4 + math.pi * radius(z) ** 2 * z * z)
    return volume, np.diag([across, across, along])


@given(sizes, sizes)
@settings(max_examples=25, deadline=None)
def test_a_capsules_inertia_is_the_integral_over_its_slices(radius: float, length: float) -> None:
    end = length / 2

    def outline(z: float) -> float:
        return math.sqrt(max(0.0, radius**2 - max(0.0, abs(z) - end) ** 2))

    volume, expected = revolved(outline, -end - radius, end + radius, [-end, end])
    shape = {"capsule": {"radius": radius, "length": length}}
    inertial = inertial_of({"visual": shape, "inertial": {"mass": 3}})
    assert matrix(inertial) == pytest.approx(3 / volume * expected, rel=1e-7)
    assert inertial_of({"visual": shape, "inertial": {"density": 3}}).mass == pytest.approx(
        3 * volume, rel=1e-9
    )


@given(sizes, sizes)
@settings(max_examples=10, deadline=None)
def test_inertia_of_a_cylinder_and_a_sphere_equals_the_integral_of_slices(
    radius: float, length: float
) -> None:
    volume, expected = revolved(lambda _: radius, -length / 2, length / 2, [])
    inertial = inertial_of(
        {"visual": {"cylinder": {"radius": radius, "length": length}}, "inertial": {"mass": 3}}
    )
    assert matrix(inertial) == pytest.approx(3 / volume * expected, rel=1e-8)
    volume, expected = revolved(lambda z: math.sqrt(radius**2 - z * z), -radius, radius, [])
    inertial = inertial_of({"visual": {"sphere": {"radius": radius}}, "inertial": {"mass": 3}})
    assert matrix(inertial) == pytest.approx(3 / volume * expected, rel=1e-6)


angles = st.tuples(*[st.floats(-3, 3)] * 3)
places = st.tuples(*[st.floats(-2, 2)] * 3)
parts = st.lists(st.tuples(st.tuples(sizes, sizes, sizes), places, angles), min_size=1, max_size=4)


@given(parts)
@settings(
    max_examples=40, deadline=None, phases=[Phase.explicit, Phase.generate]
)  # shrinking takes ten minutes
def test_several_turned_boxes_have_the_inertia_of_their_triangles(boxes: list[Any]) -> None:
    """The products of inertia too: trimesh integrates over the triangles of all boxes together."""
    meshes, shapes = [], []
    for size, xyz, rpy in boxes:
        mesh = trimesh.creation.box(size)
        rotation = Rotation.from_euler("xyz", rpy).as_matrix()
        mesh.vertices = mesh.vertices @ rotation.T + xyz  # apply_transform does nothing below 1e-8
        meshes.append(mesh)
        shapes.append({"box": list(size), "xyz": list(xyz), "rpy": list(rpy)})
    full: Any = trimesh.util.concatenate(meshes)
    full.density = 7.0
    inertial = inertial_of({"collision": shapes, "inertial": {"density": 7}})
    assert inertial.mass == pytest.approx(7 * full.volume, rel=1e-9)
    assert inertial.pose.xyz == pytest.approx(tuple(full.center_mass), abs=1e-9)
    lost = 1e-13 * inertial.mass * 100  # trimesh integrates about the origin, up to 10 m away
    assert matrix(inertial) == pytest.approx(full.moment_inertia, rel=1e-8, abs=lost)


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
@pytest.mark.parametrize("inwards", [False, True])
def test_a_mesh_has_the_inertia_of_the_box_that_it_shows(
    tmp_path: Path, ending: str, *, inwards: bool
) -> None:
    chance = random.Random(4)
    size, shift = [0.3, 0.5, 0.9], [chance.uniform(-1, 1) for _ in range(3)]
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(shift)
    if inwards:
        mesh.invert()
    mesh.export(tmp_path / f"box.{ending}")
    pose = {"xyz": [1, 2, 3], "rpy": [0.3, -0.4, 0.5]}
    by_mesh = inertial_of(
        {
            "visual": {"mesh": {"uri": f"box.{ending}", "scale": [2, 1, 0.5]}, **pose},
            "inertial": {"density": 2},
        },
        tmp_path,
    )
    scaled = [2 * shift[0], shift[1], shift[2] / 2]
    moved = Rotation.from_euler("xyz", pose["rpy"]).apply(scaled) + pose["xyz"]
    box = {"box": [0.6, 0.5, 0.45], "xyz": moved.tolist(), "rpy": pose["rpy"]}
    by_box = inertial_of({"visual": box, "inertial": {"density": 2}})
    assert by_mesh.mass == pytest.approx(by_box.mass, rel=1e-6)
    assert by_mesh.pose.xyz == pytest.approx(by_box.pose.xyz, abs=1e-6)
    assert matrix(by_mesh) == pytest.approx(matrix(by_box), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("inwards", [False, True])
def test_an_inward_mesh_is_flipped_but_a_cavity_is_kept(tmp_path: Path, *, inwards: bool) -> None:
    """In the hole of a ring it stands apart, though it is within the ring's bounds.

    In the box it is a hole.
    """
    ring = trimesh.creation.annulus(r_min=0.3, r_max=0.5, height=0.4, sections=64)
    box, apart, cavity = (trimesh.creation.box([side] * 3) for side in (0.6, 0.2, 0.4))
    box.apply_translation([2, 0, 0])
    cavity.apply_translation([2.05, 0, 0])
    expected = ring.volume + 0.6**3 + 0.2**3 - 0.4**3
    x = (2 * 0.6**3 - 2.05 * 0.4**3) / expected
    for inverted in (apart, cavity):
        inverted.invert()
    mesh: Any = trimesh.util.concatenate([cavity, ring, apart, box])
    if inwards:
        mesh.invert()
    mesh.export(tmp_path / "several.stl")
    inertial = inertial_of(
        {"visual": {"mesh": "several.stl"}, "inertial": {"density": 1}}, tmp_path
    )
    assert inertial.mass == pytest.approx(expected, rel=1e-6)
    assert inertial.pose.xyz == pytest.approx((x, 0, 0), abs=1e-6)


@pytest.mark.filterwarnings(
    "ignore:Setting the shape on a NumPy array:DeprecationWarning"
)  # of pycollada's writer
def test_a_collada_file_is_as_large_as_its_unit_says(tmp_path: Path) -> None:
    """RViz and Gazebo show it so: a box of 300 mm is not one of 300 m."""
    text = trimesh.creation.box([300, 500, 900]).export(file_type="dae").decode()
    (tmp_path / "box.dae").write_text(
        text.replace("<asset>", '<asset><unit name="millimeter" meter="1.0e-3"/>')
    )
    by_mesh = inertial_of({"visual": {"mesh": "box.dae"}, "inertial": {"density": 2}}, tmp_path)
    by_box = inertial_of({"visual": {"box": [0.3, 0.5, 0.9]}, "inertial": {"density": 2}})
    assert by_mesh.mass == pytest.approx(by_box.mass, rel=1e-6)
    assert matrix(by_mesh) == pytest.approx(matrix(by_box), rel=1e-6)


def test_a_given_centre_of_mass_is_kept_with_the_tensor_of_the_shapes() -> None:
    shape = {"visual": {"box": [1, 2, 3], "xyz": [0.1, 0, 0]}}
    free = inertial_of(shape | {"inertial": {"mass": 2}})
    moved = inertial_of(shape | {"inertial": {"mass": 2, "xyz": [0, 0, -0.2]}})
    assert free.pose.xyz == (0.1, 0, 0)
    assert moved.pose.xyz == (0, 0, -0.2)
    assert moved.tensor == free.tensor


def test_a_tensor_that_is_given_keeps_its_products_and_its_frame() -> None:
    tensor = {"ixx": 1, "ixy": 0.1, "ixz": -0.2, "iyy": 1.5, "iyz": 0.3, "izz": 2}
    inertial = inertial_of(
        {"inertial": {"mass": 2, "inertia": tensor, "xyz": [1, 0, 0], "rpy": [0, 0, "90 deg"]}}
    )
    assert inertial.tensor == (1, 0.1, -0.2, 1.5, 0.3, 2)
    assert inertial.pose.xyz == (1, 0, 0)
    assert inertial.pose.rpy == pytest.approx((0, 0, math.pi / 2))


def test_computing_leaves_no_noise_in_products_that_are_nothing() -> None:
    turned = [
        {"box": [1, 2, 3], "rpy": ["90 deg", 0, "90 deg"]},
        {"cylinder": {"radius": 0.3, "length": 1}, "xyz": [0, 0, 1]},
    ]
    assert inertial_of({"visual": turned, "inertial": {"mass": 7}}).tensor[1:5:3] == (0, 0)
    assert inertial_of({"visual": turned, "inertial": {"mass": 7}}).tensor[2] == 0


def test_a_moment_that_is_small_next_to_the_others_is_none_the_less_there() -> None:
    assert inertial_of({"visual": {"box": [1e-6, 1e6, 0.1]}, "inertial": {"mass": 12}}).tensor[
        3
    ] == pytest.approx(0.01)


def test_collision_shapes_carry_the_mass_where_there_are_any() -> None:
    both = inertial_of(
        {"visual": {"box": [9, 9, 9]}, "collision": {"box": [1, 1, 1]}, "inertial": {"density": 5}}
    )
    assert both.mass == 5
