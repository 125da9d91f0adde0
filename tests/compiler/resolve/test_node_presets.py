"""What a process takes from the preset of its node."""

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.resolve.presets import node_preset, node_preset_names

HEAD = """
tfcompose: 1
robot: r
links: {base_link: {}}
frames: {odom: {}, base_link: {parent: odom, owner: ekf}}
processes:
"""


def compiled(processes: str) -> Compiled:
    return compile_robot(f"{HEAD}{processes}\n", "r.yaml", library())


@pytest.mark.parametrize(
    ("process", "package", "executable", "argv"),
    [
        ("ekf: {node: robot_localization/ekf}", "robot_localization", "ekf_node", ()),
        ("ekf: {node: {preset: ekf}}", "robot_localization", "ekf_node", ()),
        (
            "ekf: {node: {preset: robot_localization/ekf}, run: {args: [--x]}}",
            "robot_localization",
            "ekf_node",
            ("--x",),
        ),
        ("ekf: {node: {preset: ekf}, run: {package: mine}}", "mine", "ekf_node", ()),
        (
            "ekf: {node: {preset: ekf}, run: {executable: ekf2}}",
            "robot_localization",
            "ekf2",
            (),
        ),
    ],
)
def test_a_node_preset_knows_what_to_start(
    process: str, package: str, executable: str, argv: tuple[str, ...]
) -> None:
    done = compiled(f"  {process}")
    assert (done.errors, done.robot is not None) == ((), True)
    assert done.robot
    ekf = next(process for process in done.robot.processes if process.name == "ekf")
    assert (ekf.kind, ekf.package, ekf.executable, ekf.argv) == ("run", package, executable, argv)
    assert [node.name for node in ekf.ros_nodes] == ["/ekf"]


@pytest.mark.parametrize(
    ("process", "code"),
    [
        ("ekf: {node: {preset: robot_localization/ekff}}", "TF601"),
        ("ekf: {node: {preset: nav2_amcl/ekf}}", "TF601"),
        ("ekf: {preset: robot_localization/ekf}", "TF101"),
        ("ekf: {node: irobot_create/create3}", "TF102"),
    ],
)
def test_what_no_preset_starts_is_one_finding(process: str, code: str) -> None:
    assert [finding.code for finding in compiled(f"  {process}").errors] == [code]


@pytest.mark.parametrize("run", ["", "run: {args: [x]}, "])
def test_a_mistyped_preset_is_named_where_nothing_says_what_to_start(run: str) -> None:
    (wrong,) = compiled(f"  ekf: {{{run}node: robot_localization/ekff}}").errors
    assert (wrong.code, "robot_localization/ekf?" in wrong.help) == ("TF102", True)


def test_a_name_with_a_namespace_stays_a_name() -> None:
    done = compiled("  ekf: {node: left/filter, external: true}")
    assert done.robot
    (ekf,) = [process for process in done.robot.processes if process.name == "ekf"]
    assert [node.name for node in ekf.ros_nodes] == ["/left/filter"]


@pytest.mark.parametrize("name", node_preset_names())
def test_each_preset_has_its_package_as_a_name_too(name: str) -> None:
    assert node_preset(f"{node_preset(name).package}/{name}") == node_preset(name)
