"""``lint --untrusted``: a stranger's robot reads only its own tree.

Besides that only installed packages and presets, and no environment.
"""

import subprocess
from pathlib import Path

import pytest

from tests.cli.test_secrets import NAMING, ROBOT
from tests.support.cli import tfcompose_in

#: A robot file beside the stranger's, whose one fault no finding may repeat.
OTHER = "tfcompose: 1\nrobot: other\nlinks: {base_link: {}}\nhunter2: {}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the folder of a robot in a repository, beside a robot of somebody else."""
    (tmp_path / "other.yaml").write_text(OTHER, "utf-8")
    made = tmp_path / "checkout" / "robots"
    made.mkdir(parents=True)
    (tmp_path / "checkout" / ".git").mkdir()
    (tmp_path / "checkout" / ".git" / "config").write_text(OTHER, "utf-8")
    (tmp_path / "checkout" / "shared.yaml").write_text(
        "frames: {mast: {parent: base_link}}\n", "utf-8"
    )
    (made / "link.yaml").symlink_to("../../other.yaml")
    return made


def lint(
    folder: Path, text: str, *options: str, **environment: str
) -> subprocess.CompletedProcess[str]:
    (folder / "robot.yaml").write_text(text, "utf-8")
    return tfcompose_in(folder, "lint", "robot.yaml", "--untrusted", *options, **environment)


OUTSIDE = ("../../other.yaml", "link.yaml", "../.git/config", "/proc/self/environ", "/etc/passwd")


@pytest.mark.parametrize("path", OUTSIDE)
@pytest.mark.parametrize("naming", NAMING)
def test_nothing_outside_of_the_robots_tree_is_read(path: str, naming: str, folder: Path) -> None:
    done = lint(folder, ROBOT.format(NAMING[naming].format(path)))
    assert not [word for word in ("hunter2", "root:", "PATH=") if word in done.stdout]
    assert "Traceback" not in done.stderr
    if naming in {"include", "part", "calibrations", "fleet"}:
        assert done.returncode
        assert "outside the robot's tree" in done.stdout


@pytest.mark.parametrize("path", ["/etc/hostname", "../../../mesh.stl", "file:///etc/hostname"])
def test_a_mesh_outside_is_refused_whether_it_is_there_or_not(path: str, folder: Path) -> None:
    done = lint(
        folder, f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{visual: {{mesh: '{path}'}}}}}}\n"
    )
    assert "[TF021]" in done.stdout


def test_what_is_in_the_repository_is_read(folder: Path) -> None:
    done = lint(folder, ROBOT.format("include: [../shared.yaml]"))
    assert (done.returncode, done.stderr) == (0, "")


def test_a_robot_file_that_is_a_link_to_elsewhere_is_refused(folder: Path) -> None:
    done = tfcompose_in(folder, "lint", "link.yaml", "--untrusted")
    assert done.returncode
    assert "link.yaml:1:1: error[TF021]" in done.stdout
    assert "hunter2" not in done.stdout


def test_packages_that_the_robot_names_are_read_and_other_folders_are_not(
    folder: Path, tmp_path: Path
) -> None:
    for name, manifest in (("arm", "package.xml"), ("home", "notes.txt")):
        (tmp_path / name).mkdir()
        (tmp_path / name / manifest).write_text("<package><name>arm</name></package>", "utf-8")
        (tmp_path / name / "arm.urdf").write_text(
            "<robot name='arm'><link name='arm'/></robot>", "utf-8"
        )
    robot = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
    robot += (
        "parts: {a: {urdf: package://arm/arm.urdf, parent: base_link}}\npackages: {arm: ../../"
    )
    for name, is_read in (("arm", True), ("home", False)):
        done = lint(folder, f"{robot}{name}}}\n")
        assert (done.returncode == 0) == is_read, done.stdout


ARGS = """tfcompose: 1
robot: r
args:
  side: {{env: SIDE, choices: [left, right], default: left}}
  token: {{env: TOKEN, default: none}}
  sim: {{env: SIM, default: false}}
links: {{base_link: {{}}}}
frames: {{eye: {{parent: "{}_lnk"}}}}
"""


def test_no_environment_is_read_but_declared_choices_and_switches(folder: Path) -> None:
    secrets = {"SIDE": "right", "TOKEN": "hunter2", "SIM": "true"}
    for name, value in (("side", "right"), ("token", "none"), ("sim", "true")):
        text = ARGS.format(f"${{args.{name}}}")
        done = lint(folder, text, **secrets)
        assert "hunter2" not in done.stdout + done.stderr
        assert f"{value}_lnk" in done.stdout, done.stdout


def test_xacro_reads_no_environment(folder: Path) -> None:
    (folder / "a.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">'
        '<link name="$(optenv TOKEN none) x"/></robot>',
        "utf-8",
    )
    for options, is_read in (((), True), (("--untrusted",), False)):
        done = tfcompose_in(folder, "lint", "a.xacro", *options, TOKEN="hunter2")  # noqa: S106
        assert ("hunter2" in done.stdout + done.stderr) == is_read


@pytest.mark.parametrize("option", ["--fix", "--diff", "--trust"])
def test_an_option_that_trusts_or_writes_is_refused(option: str, folder: Path) -> None:
    done = lint(folder, ROBOT.format(""), option)
    assert (done.returncode, done.stdout) == (2, "")
    assert option in done.stderr
