"""What is looked at before anything is started."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.findings import expect
from tfcompose.foundation.findings import Finding
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.tf.ros.environment import child_environment
from tfcompose.tools.fleet.preflight import SHARE_COMMAND


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """Return a ROS prefix with one package of two programs, one of them not executable."""
    folder = tmp_path / "ros" / "lib" / "sllidar_ros2"
    folder.mkdir(parents=True)
    for name, mode in (("sllidar_node", 0o755), ("notes.txt", 0o644)):
        (folder / name).touch()
        (folder / name).chmod(mode)
    return tmp_path / "ros"


def inspect(
    tmp_path: Path,
    *processes: PlanProcess,
    env: Mapping[str, str] | None = None,
    ros: RosSettings | None = None,
) -> tuple[dict[str, ChildCommand], list[Finding]]:
    plan = Plan("rover", "", None, ros or RosSettings(), (), processes)
    base = {"PATH": os.environ["PATH"]} | dict(env or {})
    return commands_of(plan, list(processes), tmp_path / "plan.json", base, child_environment)


def lidar(word: str) -> PlanProcess:
    return PlanProcess("lidar", "run", argv=(word, "-x"))


def test_a_ros_executable_is_found_below_the_prefixes_in_their_order(
    tmp_path: Path, prefix: Path
) -> None:
    path = f"{tmp_path}/other:{prefix}"
    commands, findings = inspect(
        tmp_path, lidar("${executable:sllidar_ros2/sllidar_node}"), env={"AMENT_PREFIX_PATH": path}
    )
    assert commands["lidar"].argv == (f"{prefix}/lib/sllidar_ros2/sllidar_node", "-x")
    assert findings == []


def test_a_ros_executable_that_no_prefix_has_is_taken_from_the_path(tmp_path: Path) -> None:
    commands, _ = inspect(tmp_path, lidar("${executable:coreutils/true}"))
    assert os.path.basename(commands["lidar"].argv[0]) == "true"  # noqa: PTH119 (a text, not a place)


STATIC = PlanProcess("static", "static", argv=("true",))
WAITING = PlanProcess("lidar", "run", argv=("true",))
#: What cannot be started, in an environment with PREFIX, a ROS prefix, or without one.
UNSTARTABLE: dict[str, tuple[PlanProcess, bool, str, list[str]]] = {
    "misspelt": (
        lidar("${executable:sllidar_ros2/slidar_node}"),
        True,
        "TF810",
        [
            "sllidar_ros2/slidar_node of lidar",
            "sllidar_node?",
            "PREFIX/lib/sllidar_ros2/slidar_node",
            "PATH",
        ],
    ),
    "not installed": (lidar("${executable:nope/no_such_node}"), True, "TF810", ["package nope"]),
    "nothing sourced": (
        lidar("${executable:nope/no_node}"),
        False,
        "TF810",
        ["setup file", "AMENT_PREFIX_PATH"],
    ),
    "not executable": (
        lidar("PREFIX/lib/sllidar_ros2/notes.txt"),
        True,
        "TF810",
        ["PREFIX/lib/sllidar_ros2/notes.txt"],
    ),
    "relative": (lidar("bin/lidar"), True, "TF810", ["${file(bin/lidar)}"]),
    "no command": (PlanProcess("lidar", "run"), True, "TF902", ["lidar"]),
    "waits for nobody": (
        replace(WAITING, after={"nobody": "started"}),
        True,
        "TF902",
        ["lidar", "nobody"],
    ),
    "waits in vain": (
        replace(WAITING, after={"static": "done"}),
        True,
        "TF902",
        ["lidar", "static"],
    ),
    "waits for itself": (replace(WAITING, after={"lidar": "ready"}), True, "TF812", ["lidar"]),
}


@pytest.mark.parametrize("case", UNSTARTABLE)
def test_what_cannot_be_started_is_one_finding_with_its_names(
    tmp_path: Path, prefix: Path, case: str
) -> None:
    process, sourced, code, names = UNSTARTABLE[case]
    process = replace(
        process, argv=tuple(word.replace("PREFIX", str(prefix)) for word in process.argv)
    )
    _, (finding,) = inspect(
        tmp_path, process, STATIC, env={"AMENT_PREFIX_PATH": str(prefix)} if sourced else None
    )
    expect(
        finding,
        code,
        *(name.replace("PREFIX", str(prefix)) if "/" in name else name for name in names),
    )


def test_everything_missing_is_one_finding_that_lists_folders_once(
    tmp_path: Path,
) -> None:
    words = {
        "laser": "${executable:sllidar_ros2/sllidar_node}",
        "slam": "${executable:slam_toolbox/slam}",
        "a": "no_a",
    }
    _, (finding,) = inspect(
        tmp_path, *(PlanProcess(name, "run", argv=(word,)) for name, word in words.items())
    )
    missing = "sllidar_ros2/sllidar_node of laser, slam_toolbox/slam of slam, no_a of a"
    expect(
        finding,
        "TF810",
        "3 executables",
        missing,
        "AMENT_PREFIX_PATH",
        "folders of PATH",
        "setup file",
    )
    assert len(finding.notes) == 2


def test_advice_that_programs_share_is_given_once(tmp_path: Path) -> None:
    node = lidar("${executable:nope/no_node}")
    launch = replace(lidar("${launch:nope/no.launch.py}"), name="stack")
    _, (finding,) = inspect(tmp_path, node, launch, env={"PATH": "/nowhere"})
    assert finding.code == "TF810"
    assert finding.help.count("setup file") == 1


def test_a_relative_program_is_found_in_the_processs_folder(tmp_path: Path, prefix: Path) -> None:
    process = PlanProcess("lidar", "run", argv=("./sllidar_node",), cwd="ros/lib/sllidar_ros2")
    commands, _ = inspect(tmp_path, process)
    assert commands["lidar"].argv == (f"{prefix}/lib/sllidar_ros2/sllidar_node",)


@pytest.mark.parametrize("cwd", ["maps", "${build_dir}/../maps"])
def test_a_folder_that_is_not_there_is_found_before_anything_is_started(
    tmp_path: Path, cwd: str
) -> None:
    process = PlanProcess("lidar", "run", argv=("true",), cwd=cwd)
    _, (finding,) = inspect(tmp_path, process)
    folder = os.path.normpath(tmp_path / cwd.replace("${build_dir}/", ""))
    expect(finding, "TF810", folder, "lidar")
    commands, found_of_optional = inspect(tmp_path, replace(process, required=False))
    assert (commands["lidar"].missing, found_of_optional) == (finding.message, [])


def test_sharing_with_a_fleet_needs_zenoh_before_anything_is_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    share = PlanProcess(
        "fleet_share", "run", argv=(*SHARE_COMMAND, "r1", "fleet.yaml"), required=False
    )
    own_share = replace(share, name="own", argv=("sh", "-c", "tfcompose fleet share"))
    monkeypatch.setattr("tfcompose.tools.fleet.preflight.find_spec", lambda _: None)
    _, (finding,) = inspect(tmp_path, share, own_share)
    expect(finding, "TF920", "fleet_share", "tfcompose[fleet]")


def test_a_placeholder_in_a_value_is_not_replaced_again(tmp_path: Path) -> None:
    process = PlanProcess(
        "lidar", "run", argv=("true", "${params_file}"), params_file="${plan}.yaml"
    )
    commands, _ = inspect(tmp_path, process)
    assert commands["lidar"].argv[1] == f"{tmp_path}/${{plan}}.yaml"


def test_processes_that_wait_for_each_other_are_a_finding(tmp_path: Path) -> None:
    a = PlanProcess("a", "run", argv=("true",), after={"b": "started"})
    b = PlanProcess("b", "run", argv=("true",), after={"a": "started"})
    _, (finding,) = inspect(tmp_path, a, b, lidar("true"))
    expect(finding, "TF812", "a, b ")


def test_a_guard_is_started_first_whatever_it_is_declared_to_wait_for(tmp_path: Path) -> None:
    guard = PlanProcess("guard", "guard", argv=("true",), after={"lidar": "started"})
    waiting = PlanProcess("lidar", "run", argv=("true",), after={"guard": "ready"})
    assert inspect(tmp_path, guard, waiting)[1] == []
