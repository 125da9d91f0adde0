"""A launch file as a process; a stand-in for ``ros2 launch`` says what it would do."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.findings import expect
from tfcompose.foundation.findings import Finding
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.preflight import commands_of
from tfcompose.launcher.supervisor import supervise
from tfcompose.model.messages import LogLine, Notice
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.tf.ros.environment import child_environment

NAV2 = PlanProcess(
    "nav2",
    "run",
    ("${launch:nav2_bringup/navigation_launch.py}", "use_composition:=False"),
    remap={"/tf": "/r/tf"},
)
#: Runs the description of the file that it is given, and prints it; ``launch`` and ``launch_ros``
#: are stand-ins.
ROS2 = """#!{python}
import importlib.util, sys, types
def module(name, *kinds):
    made = sys.modules[name] = types.ModuleType(name)
    for kind in kinds:
        setattr(made, kind, lambda *words, _kind=kind, **named: [_kind, *words, *map(list, named.items())])
module("launch", "LaunchDescription")
module("launch.actions", "GroupAction", "IncludeLaunchDescription")
module("launch.launch_description_sources", "AnyLaunchDescriptionSource")
module("launch_ros"), module("launch_ros.actions", "PushRosNamespace", "SetRemap", "SetParameter")
spec = importlib.util.spec_from_file_location("launch_file", sys.argv[-1])
launch_file = importlib.util.module_from_spec(spec)
spec.loader.exec_module(launch_file)
import json
print(json.dumps([sys.argv[1:-1], launch_file.generate_launch_description()]))
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture
def env(tmp_path: Path) -> dict[str, str]:
    launch = tmp_path / "ros" / "share" / "nav2_bringup" / "launch"
    launch.mkdir(parents=True)
    (launch / "navigation_launch.py").touch()
    ros2 = tmp_path / "bin" / "ros2"
    ros2.parent.mkdir()
    ros2.write_text(ROS2.replace("{python}", sys.executable))
    ros2.chmod(0o755)
    path = f"{ros2.parent}{os.pathsep}{os.environ['PATH']}"
    return dict(os.environ) | {"PATH": path, "AMENT_PREFIX_PATH": str(tmp_path / "ros")}


def inspect(
    tmp_path: Path, env: dict[str, str], process: PlanProcess = NAV2
) -> tuple[dict[str, ChildCommand], Finding | None]:
    plan = Plan("rover", "", None, RosSettings(), (), (process,))
    commands, findings = commands_of(
        plan, [process], tmp_path / "plan.json", env, child_environment
    )
    return commands, findings[0] if findings else None


@pytest.mark.parametrize(("own_namespace", "namespace"), [(None, "r"), ("r/nav", "r/nav")])
def test_an_include_has_namespace_remappings_sim_time_and_arguments(
    tmp_path: Path, env: dict[str, str], own_namespace: str | None, namespace: str
) -> None:
    plan = Plan(
        "rover",
        "",
        None,
        RosSettings("r", clock="sim"),
        (),
        (replace(NAV2, namespace=own_namespace),),
    )
    notices: list[Notice] = []
    assert supervise(plan, tmp_path / "plan.json", report=notices.append, base_env=env) == 0
    (line,) = [notice.text for notice in notices if isinstance(notice, LogLine)]
    words, description = json.loads(line)
    file = f"{tmp_path}/ros/share/nav2_bringup/launch/navigation_launch.py"
    assert words == ["launch", "--noninteractive"]
    assert description == [
        "LaunchDescription",
        [
            [
                "GroupAction",
                [
                    ["PushRosNamespace", namespace],
                    ["SetRemap", "/tf", "/r/tf"],
                    ["SetParameter", "use_sim_time", ["value", True]],
                    [
                        "IncludeLaunchDescription",
                        ["AnyLaunchDescriptionSource", file],
                        ["launch_arguments", [["use_composition", "False"]]],
                    ],
                ],
            ]
        ],
    ]


@pytest.mark.parametrize(
    ("theirs", "output"), [({}, "both"), ({"OVERRIDE_LAUNCH_PROCESS_OUTPUT": "log"}, "log")]
)
def test_output_of_nodes_goes_to_the_log_unless_the_user_redirects_it(
    tmp_path: Path, env: dict[str, str], theirs: dict[str, str], output: str
) -> None:
    env.pop("OVERRIDE_LAUNCH_PROCESS_OUTPUT", None)
    commands, _ = inspect(tmp_path, env | theirs)
    assert commands["nav2"].env["OVERRIDE_LAUNCH_PROCESS_OUTPUT"] == output


def test_without_ros2_it_says_what_brings_it(tmp_path: Path, env: dict[str, str]) -> None:
    _, finding = inspect(tmp_path, env | {"PATH": "/nowhere"})
    assert finding
    expect(
        finding,
        "TF810",
        "ros2 (for launch nav2_bringup/navigation_launch.py) of nav2",
        "ros2launch",
    )


@pytest.mark.parametrize(
    ("word", "advice"),
    [
        ("nav2_bringup/navigaton_launch.py", "navigation_launch.py?"),
        ("nav2/navigation_launch.py", "package nav2"),
    ],
)
def test_a_launch_file_that_is_not_there_is_named_with_what_is(
    tmp_path: Path, env: dict[str, str], word: str, advice: str
) -> None:
    _, finding = inspect(tmp_path, env, PlanProcess("nav2", "run", (f"${{launch:{word}}}",)))
    assert finding
    expect(finding, "TF810", f"{word} of nav2", advice)


def test_a_word_that_is_no_argument_is_refused(tmp_path: Path, env: dict[str, str]) -> None:
    _, finding = inspect(tmp_path, env, PlanProcess("nav2", "run", (*NAV2.argv, "--debug")))
    assert finding
    expect(finding, "TF902", "nav2", "--debug")
