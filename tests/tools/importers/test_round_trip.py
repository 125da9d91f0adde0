"""``tfcompose import``: building what it writes gives the URDF that it was written from."""

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.importing import PRESETS, built, imported, urdf_of
from tests.support.random_robot import spec as family
from tests.support.same_urdf import same
from tfcompose.cli import compiling, main
from tfcompose.compiler.resolve.presets import holds
from tfcompose.spec.load import load

#: Folders of installed packages that hold URDFs; nothing of them is kept here.
PACKAGES = (
    "cmeel.prefix/share/example-robot-data/robots",
    "pybullet_data",
    "pydrake/share/drake/examples",
    "mujoco",
)


def shipped() -> list[Path]:
    """Return the URDFs that installed packages bring, but for the many of one kind."""
    folders = [Path(entry) / package for entry in sys.path for package in PACKAGES]
    return sorted(
        file
        for folder in folders
        for file in folder.rglob("*.urdf")
        if "random_urdfs" not in file.parts
    )


#: The robots among them that are refused, by the packages that ship them, with the codes and the
#: reason; everything else is taken.
REFUSED: dict[str, dict[str, tuple[set[str], str]]] = {
    "example-robot-data": {
        "alex_psyonic_hands": ({"TF701"}, "finger joints follow joints that are called otherwise"),
        "romeo_laas_small": (
            {"TF723"},
            "meshes at absolute paths of the one machine that they were on",
        ),
        "talos_full_v2": ({"TF723"}, "package:/// with a slash too many is no address"),
        "talos_full_v2_box": ({"TF723"}, "as talos_full_v2"),
        "ur3": ({"TF206", "TF721"}, "an expanded file of macros alone: no links, no name"),
    },
    "pybullet_data": {
        "bike": ({"TF721"}, "commas between numbers, at which readers stop"),
        "biped2d_pybullet": ({"TF018"}, "an empty line before the XML declaration"),
        "cube_no_rotation": (
            {"TF705"},
            "lower above upper: free to its simulator, no position at all to others",
        ),
        "diff_ring": ({"TF018"}, "as biped2d_pybullet"),
        "humanoid/humanoid": ({"TF001"}, "a NUL byte at its end"),
        "pybullet_data/husky/husky": ({"TF721"}, "xacro that nobody expanded: $(optenv …)"),
        "model_for_sdf": ({"TF723"}, "meshes that are not shipped with it"),
        "microtaur": ({"TF721"}, "four numbers in rpy"),
        "racecar_differential": (
            {"TF721", "TF723"},
            "four numbers in scale, and a mesh that is not there",
        ),
        "spherical_joint_limit": ({"TF721"}, "a joint type that URDF does not have"),
        "torus_deform": ({"TF206"}, "a deformable body of its simulator alone: no links"),
    },
    "pydrake": {
        "Acrobot": ({"TF203"}, "its root is a link world that it does not declare"),
    },
}


def codes_of(file: Path) -> set[str]:
    """Return the codes for which the robot is refused; none for one that is taken."""
    name = file.with_suffix("").as_posix()
    refused = (robot for robots in REFUSED.values() for robot in robots.items())
    return next((codes for end, (codes, _) in refused if name.endswith(f"/{end}")), set())


@pytest.mark.parametrize("file", shipped(), ids=lambda file: file.stem)
def test_building_what_import_writes_gives_the_robot_of_the_source(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the source has errors, import refuses it with these, and writes nothing."""
    out, refused = tmp_path / "robot.yaml", codes_of(file)
    code = main(["import", str(file), "-o", str(out)])
    assert set(re.findall(r"error\[(TF\d+)\]", capsys.readouterr().err)) == refused
    if refused:
        assert code == (2 if "TF001" in refused else 1)
        assert not out.exists()
    else:
        assert not same(file.read_text("utf-8"), file.parent, built(out), tmp_path)


@pytest.mark.parametrize("package", REFUSED)
def test_every_robot_that_is_listed_as_refused_is_shipped(package: str) -> None:
    names = [file.with_suffix("").as_posix() for file in shipped() if package in file.parts]
    if not names:
        pytest.skip(f"{package} is not installed: it has no wheel for every Python")
    assert [
        end for end in REFUSED[package] if not any(name.endswith(f"/{end}") for name in names)
    ] == []


@pytest.mark.parametrize("seed", range(12))
def test_a_generated_robot_comes_back_the_same(seed: int, tmp_path: Path) -> None:
    """Every joint type, every shape, masses of all kinds."""
    urdf = urdf_of(family(seed), tmp_path)
    imported(urdf, tmp_path)
    assert not same(urdf, tmp_path, built(tmp_path / "robot.yaml"), tmp_path)


@pytest.fixture(autouse=True)
def _one_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read the presets once for all tests: that is most of what importing a small robot costs."""
    monkeypatch.setattr(compiling, "library", lambda: PRESETS)


#: Presets that other ones cannot be told from by their frames, and those that the frame itself is
#: all of.
ALIKE = {"generic/camera", "generic/rgbd"}


@pytest.mark.parametrize("name", PRESETS.names)
def test_a_sensor_is_recognised_or_left_as_frames_and_the_tree_is_the_same(
    name: str, tmp_path: Path
) -> None:
    preset = PRESETS.get(name)
    sensor: dict[str, Any] = {
        "preset": name,
        "parent": "base_link",
        "xyz": [0.1, 0, 0.2],
        "rpy": [0, 0.3, 0],
    }
    sensor |= {"driver": "none"} if preset.driver else {}
    frames = {
        key: frame
        for key, frame in preset.frames.items()
        if holds(frame.when, _usual(preset), "tfcompose")
    }
    frame_names = {
        key.replace("{name}", "front"): UNIT for key, frame in frames.items() if frame.xyz is None
    }
    sensor |= {"frames": frame_names} if frame_names else {}
    spec = {"tfcompose": 1, "robot": "r", "links": {"base_link": {}}, "sensors": {"front": sensor}}
    spec["rules"] = {"TF401": "off"}
    urdf = urdf_of(spec, tmp_path)
    source = tmp_path / "source.urdf"
    source.write_text(urdf, encoding="utf-8")
    main(["import", str(source), "-o", str(tmp_path / "robot.yaml"), "--keep-going"])
    sensors = load((tmp_path / "robot.yaml").read_text("utf-8"), "robot.yaml").data.get(
        "sensors", {}
    )
    taken = sensors.get("front", {}).get("preset")
    assert taken in {name, None} | ALIKE
    (tmp_path / "robot.yaml").write_text(
        (tmp_path / "robot.yaml").read_text("utf-8") + "\nrules: {TF401: off}\n"
    )
    assert not same(urdf, tmp_path, built(tmp_path / "robot.yaml"), tmp_path)


UNIT = {"xyz": [0.01, 0.02, 0.03], "rpy": [0, 0, 0]}


def _usual(preset: Any) -> dict[str, Any]:
    return {key: option.default for key, option in preset.options.items()}
