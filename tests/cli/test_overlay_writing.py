"""Writing a mount's pose into the overlay of one robot."""

import json
import os
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import pytest

from tests.support.processes import run
from tfcompose.cli import main
from tfcompose.cli.options import add_variant
from tfcompose.cli.robot_overlay import RobotOverlay, fixed_mount
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.spec.language.overlay_text import read_overlay

ROBOT = """\
tfcompose: 1
robot: rover
links: {base_link: {visual: {box: [2, 2, 2]}}}
frames:
  mast: {parent: base_link, xyz: [0, 0, 0.3], look: left}
  hook: {parent: mast, relative_to: base_link, xyz: [0.5, 0, 0.5]}
overlays: {by: hostname, folder: units}
"""
OVERLAY = "units/ant.yaml"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    return tmp_path


def opened(*options: str) -> RobotOverlay:
    parser = ArgumentParser()
    add_variant(parser)
    arguments = parser.parse_args(options, Namespace(arg_values={}))
    arguments.arg_values = {}
    return RobotOverlay.open("robot.yaml", arguments, "ant")


def pose_of(child: str, *options: str) -> list[list[float]]:
    assert main(["build", "-o", "out", "--robot", "ant", *options]) == 0
    plan = json.loads(Path("out/plan.json").read_text("utf-8"))
    pose: list[list[float]] = next(
        edge["pose"] for edge in plan["edges"] if edge["child"] == child
    )
    return pose


def codes_of(error: pytest.ExceptionInfo[RejectedError]) -> list[str]:
    return [finding.code for finding in error.value.findings]


@pytest.mark.parametrize("child", ["mast", "hook"])
def test_the_robot_gets_the_pose_and_lint_finds_nothing(
    child: str, capsys: pytest.CaptureFixture[str]
) -> None:
    new = Pose((0.4, 0.1, 0.2), quat_from_rpy(0.01, -0.02, 1.5))
    assert opened().save(child, new, "calibrate", joins=False)
    xyz, quat = pose_of(child)
    assert xyz == pytest.approx(new.xyz, abs=1e-6)
    assert quat == pytest.approx(new.quat_xyzw, abs=1e-6)
    capsys.readouterr()
    assert main(["lint", "robot.yaml"]) == 0
    assert capsys.readouterr().out == "no findings in 1 file\n"


def test_a_value_of_the_robot_file_is_not_repeated() -> None:
    assert opened().save("mast", Pose((0, 0, 0.3)), "nudge", joins=True)
    assert "xyz" not in opened().text.split("x-adjustments")[0]  # type: ignore[union-attr]
    assert main(["lint", "robot.yaml"]) == 0


def test_many_nudges_are_one_entry_and_undo_restores_the_first_pose() -> None:
    before = "# ours\nframes:\n  mast:\n    look: right   # loose\n"
    Path("units").mkdir()
    Path(OVERLAY).write_text(before, "utf-8")
    for step in range(1, 11):
        assert opened().save("mast", Pose((step / 1000, 0, 0.3)), "nudge", joins=True)
    text = Path(OVERLAY).read_text("utf-8")
    (adjustment,) = read_overlay(text, OVERLAY).adjustments(("frames", "mast"))
    assert adjustment.before == {"look": "right"}
    assert text.count("mast:") == 2
    assert pose_of("mast")[0] == [0.01, 0, 0.3]
    compiled = opened().compile(text)
    overlay = opened()
    _, restored = overlay.without_newest(fixed_mount(compiled, "mast"))
    overlay.write(restored)
    assert restored == before


@pytest.mark.parametrize("null", ["", " ~", " null"])
def test_a_key_that_removes_a_value_is_restored(null: str) -> None:
    Path("units").mkdir()
    before = f"frames:\n  mast:\n    look:{null}\n    calibration: null\n    rpy: [0, 0, 1]\n"
    Path(OVERLAY).write_text(before, "utf-8")
    assert opened().save("mast", Pose((0, 0, 0.4)), "nudge", joins=True)
    assert pose_of("mast")[0] == [0, 0, 0.4]
    overlay = opened()
    _, restored = overlay.without_newest(fixed_mount(overlay.compile(overlay.text), "mast"))
    keys = read_overlay(restored, OVERLAY).pose_of(("frames", "mast"), OVERLAY)
    assert keys == {"look": None, "calibration": None, "rpy": [0, 0, 1]}


def test_an_equal_pose_leaves_the_overlay_alone() -> None:
    pose = Pose((0, 0, 0.3), quat_from_rpy(0, 0, 1.5707963267948966))
    assert not opened().save("mast", pose, "nudge", joins=True)
    assert not Path(OVERLAY).exists()


def test_a_file_that_changed_meanwhile_is_not_overwritten() -> None:
    first, second = opened(), opened()
    assert first.save("mast", Pose((0, 0, 0.4)), "nudge", joins=True)
    text = Path(OVERLAY).read_text("utf-8")
    with pytest.raises(OSError, match="meantime"):
        second.save("mast", Pose((0, 0, 0.5)), "nudge", joins=True)
    assert opened().save("mast", Pose((0, 0, 0.6)), "nudge", joins=True)
    with pytest.raises(OSError, match="meantime"):
        RobotOverlay(first.source, first.arguments, OVERLAY, text).save(
            "mast", Pose((0, 0, 0.7)), "nudge", joins=True
        )
    assert pose_of("mast")[0] == [0, 0, 0.6]


@pytest.mark.parametrize(
    ("options", "overlay"),
    [
        (("--set", "frames.mast.xyz=[1, 1, 1]"), ""),
        ((), "x-a: &a {xyz: [1, 1, 1]}\nframes: {mast: {<<: *a}}\n"),
        ((), "frames: {mast: {look: right}}\nx-adjustments: {frames.mast: [later]}\n"),
    ],
)
def test_an_overlay_that_cannot_set_the_pose_is_refused(
    options: tuple[str, ...], overlay: str
) -> None:
    if overlay:
        Path("units").mkdir()
        Path(OVERLAY).write_text(overlay, "utf-8")
    with pytest.raises(RejectedError) as error:
        opened(*options).save("mast", Pose((0, 0, 2)), "nudge", joins=True)
    assert codes_of(error) == ["TF662"]
    assert error.value.findings[0].span.line == 7  # type: ignore[union-attr]
    assert Path(OVERLAY).exists() == bool(overlay)


def test_values_of_an_overlay_take_precedence_over_files_for_all_mounts(folder: Path) -> None:
    kit = "base_link: {mast: {x: 0, y: 0, z: 0.31, roll: 0, pitch: 0, yaw: 1.57}}\n"
    (folder / "kit.yaml").write_text(kit, "utf-8")
    (folder / "robot.yaml").write_text(f"{ROBOT}calibrations: [kit.yaml]\n", "utf-8")
    assert opened().save("mast", Pose((0, 0, 0.33)), "nudge", joins=True)
    assert pose_of("mast")[0] == [0, 0, 0.33]


#: Kills a process that writes an overlay, after its first call into C, its third, and so on, until
#: it ends before.
KILLER = """\
import os, signal, sys
from dataclasses import replace
from pathlib import Path
from tests.cli.test_overlay_writing import OVERLAY, opened

OLD, NEW = "# old\\ntfcompose: 1\\n", "# new\\ntfcompose: 1\\n"
opened().write(OLD)
overlay, results = opened(), []
while True:
    child = os.fork()
    if not child:
        left = 2 * len(results)
        def count(frame, event, argument):
            global left
            left -= event == "c_return"
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)
        sys.setprofile(count)
        overlay.write(NEW)
        os._exit(0)
    if not os.waitpid(child, 0)[1]:
        break
    results.append(Path(OVERLAY).read_text())
    if results[-1] != OLD:
        replace(overlay, text=NEW).write(OLD)
assert {*results} == {OLD, NEW}, results
assert len(results) > 20, results
"""


def test_a_killed_write_leaves_the_old_file_or_the_new_file() -> None:
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    ended = run([sys.executable, "-c", KILLER], env=environment)
    assert ended.returncode == 0, ended.stderr
