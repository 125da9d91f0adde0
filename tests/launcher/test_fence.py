"""How a strict plan's processes are fenced off.

By profiles with a partition, or by remappings; and what cannot be.
"""

import json
import os
import re
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.findings import expect
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.preflight import LAUNCH, commands_of
from tfcompose.model.plan import (
    PROGRAM,
    FenceWay,
    GuardPolicy,
    Plan,
    PlanEdge,
    PlanProcess,
    RosSettings,
    SourceLine,
)
from tfcompose.model.plan.topics import private_topics
from tfcompose.model.variables import REMAPPED
from tfcompose.tf.ros.environment import child_environment

GUARD = PlanProcess("guard", "guard", argv=("true",))
SLAM = PlanProcess("slam", "run", argv=("true",), nodes=("/slam",), owns=(("map", "odom"),))


def plan_of(*processes: PlanProcess, fence: FenceWay = "auto") -> Plan:
    edges = tuple(
        PlanEdge(
            parent,
            child,
            "dynamic",
            process.name,
            f"/{process.name}",
            Pose(),
            None,
            SourceLine("rover.yaml", 1),
        )
        for process in processes
        for parent, child in process.owns
    )
    return Plan(
        "rover", "", None, RosSettings(), edges, processes, GuardPolicy("strict", fence=fence)
    )


def inspect(
    tmp_path: Path, *processes: PlanProcess, fence: FenceWay = "auto", **env: str
) -> tuple[dict[str, ChildCommand], list[Finding]]:
    base = {"PATH": os.environ["PATH"]} | env
    plan = plan_of(*processes, fence=fence)
    return commands_of(plan, list(processes), tmp_path / "plan.json", base, child_environment)


def partitions(command: ChildCommand) -> dict[tuple[str, str], str]:
    """Return the partitions that a command's fence gives readers or writers of a topic."""
    assert command.fence
    root = ET.fromstring(command.fence[1])  # noqa: S314 (made here)
    name = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
    return {
        (element.tag.removeprefix(name), element.attrib["profile_name"]): (
            element.findtext(f".//{name}value") or ""
        )
        for element in root.iter()
        if element.tag.startswith(f"{name}data_")
    }


def moved(command: ChildCommand) -> dict[str, str]:
    """Return what the command's ROS arguments remap, by the first rule that fits, as ROS does."""
    rules = [
        word.split(":=")
        for flag, word in zip(command.argv, command.argv[1:], strict=False)
        if flag == "-r"
    ]
    return dict(reversed(rules))


# By partition.


def test_a_strict_plan_fences_its_children_and_only_the_guard_reads_them(
    tmp_path: Path,
) -> None:
    slam = PlanProcess(
        "slam", "run", argv=("true",), remap={"/tf": "/r/tf"}, owns=(("map", "odom"),)
    )
    commands, findings = inspect(tmp_path, slam, GUARD)
    assert findings == []
    assert partitions(commands["slam"]) == {
        ("data_writer", "/r/tf"): "tfc_rover",
        ("data_writer", "/tf_static"): "tfc_rover",
    }
    readers = {("data_reader", topic): "tfc_rover" for topic in ("/r/tf", "/tf_static", "/tf")}
    assert partitions(commands["guard"]) == readers
    for command in commands.values():
        assert command.fence
        assert command.env["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(command.fence[0])
        assert not command.fence[0].exists(), "nothing is written before the start"
    assert REMAPPED not in commands["guard"].env
    assert "leaseAnnouncement" in (commands["guard"].fence or ("", ""))[1]
    assert "leaseAnnouncement" not in (commands["slam"].fence or ("", ""))[1]


NAMESPACE = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
IGNORES_ITSELF = "fastdds.ignore_local_endpoints"


def participant_properties(command: ChildCommand) -> dict[str | None, str | None]:
    """Return the properties that a command's fence gives its participants."""
    assert command.fence
    root = ET.fromstring(command.fence[1])  # noqa: S314 (made here)
    path = "participant[@is_default_profile='true']/rtps/propertiesPolicy/properties/property"
    path = "/".join(f"{NAMESPACE}{step}" for step in path.split("/"))
    return {
        element.findtext(f"{NAMESPACE}name"): element.findtext(f"{NAMESPACE}value")
        for element in root.findall(f".//{path}")
    }


def with_participant(properties: str) -> str:
    return (
        f'<dds xmlns="{NAMESPACE[1:-1]}"><profiles><participant profile_name="mine" '
        'is_default_profile="true"><rtps><name>n</name><propertiesPolicy><properties>'
        f"{properties}</properties></propertiesPolicy></rtps></participant></profiles></dds>"
    )


@pytest.mark.parametrize(
    ("users", "expected"),
    [
        pytest.param("", {IGNORES_ITSELF: "true"}, id="no file"),
        pytest.param(f'<dds xmlns="{NAMESPACE[1:-1]}"/>', {IGNORES_ITSELF: "true"}, id="empty"),
        pytest.param(
            with_participant("<property><name>a</name><value>b</value></property>"),
            {"a": "b", IGNORES_ITSELF: "true"},
            id="another property",
        ),
        pytest.param(
            with_participant(
                f"<property><name>{IGNORES_ITSELF}</name><value>false</value></property>"
            ),
            {IGNORES_ITSELF: "false"},
            id="decided by the user",
        ),
    ],
)
def test_a_strict_guard_receives_nothing_of_what_it_sends_itself(
    tmp_path: Path, users: str, expected: dict[str, str]
) -> None:
    (tmp_path / "own.xml").write_text(users)
    named = str(tmp_path / "own.xml") if users else ""
    commands, findings = inspect(tmp_path, SLAM, GUARD, FASTRTPS_DEFAULT_PROFILES_FILE=named)
    assert findings == []
    assert participant_properties(commands["guard"]) == expected
    assert IGNORES_ITSELF not in participant_properties(commands["slam"]) or "false" in users


#: A file as users have them: the writers' default, one for a topic of TF, and one for another.
USERS = """<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- caf\xe9 -->
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <profiles>
    <publisher profile_name="all" is_default_profile="true">
      <historyMemoryPolicy>DYNAMIC</historyMemoryPolicy>
    </publisher>
    <data_writer profile_name="/scan"><userDefinedID>7</userDefinedID></data_writer>
    <data_writer profile_name="/tf_static">
      <propertiesPolicy><properties><property><name>a</name><value>b</value></property></properties></propertiesPolicy>
    </data_writer>
  </profiles>
</dds>
"""


def test_the_fence_is_merged_into_a_users_own_profiles(tmp_path: Path) -> None:
    (tmp_path / "own.xml").write_text(USERS, encoding="iso-8859-1")
    drive = replace(SLAM, name="drive", cwd=str(tmp_path), owns=(("odom", "base"),))
    commands, findings = inspect(
        tmp_path, drive, GUARD, FASTRTPS_DEFAULT_PROFILES_FILE=str(tmp_path / "own.xml")
    )
    relative, more = inspect(tmp_path, drive, FASTRTPS_DEFAULT_PROFILES_FILE="own.xml")
    assert findings == more == []
    assert commands["drive"].fence == relative["drive"].fence, (
        "a relative path is one of the process's folder"
    )
    text = commands["drive"].fence[1] if commands["drive"].fence else ""
    name = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
    root = ET.fromstring(text)  # noqa: S314 (made here)
    writers = {
        element.attrib["profile_name"]: element
        for element in root.iter()
        if element.tag == f"{name}data_writer"
    }
    writers |= {
        element.attrib["profile_name"]: element
        for element in root.iter()
        if element.tag == f"{name}publisher"
    }
    values = {
        topic: [value.text for value in writer.iter(f"{name}value")]
        for topic, writer in writers.items()
    }
    assert values == {
        "all": [],
        "/scan": [],
        "/tf_static": ["b", "tfc_rover"],
        "/tf": ["tfc_rover"],
    }
    assert writers["/tf"].findtext(f"{name}historyMemoryPolicy") == "DYNAMIC", (
        "what holds for all writers"
    )
    assert [topic for topic, writer in writers.items() if writer.get("is_default_profile")] == [
        "all"
    ]
    assert writers["/scan"].findtext(f"{name}userDefinedID") == "7"
    assert "tfc_rover" in (commands["guard"].fence or ("", ""))[1]


def test_a_process_that_sends_on_topics_that_nobody_judges_is_left_alone(tmp_path: Path) -> None:
    debug = PlanProcess(
        "debug",
        "run",
        argv=("true",),
        nodes=("/debug",),
        owns=(),
        remap={"/tf": "/x/tf", "/tf_static": "/x/s"},
    )
    for fence in ("partition", "remap"):
        commands, findings = inspect(tmp_path, SLAM, debug, GUARD, fence=fence)
        assert findings == []
        assert commands["debug"].fence is None
        assert commands["debug"].argv[1:] == ()


IN_A_PARTITION = "<property><name>partitions</name><value>mine</value></property>"
POLICY = f"<propertiesPolicy><properties>{IN_A_PARTITION}</properties></propertiesPolicy>"
#: Files to which no fence can be added.
BAD_PROFILES = (
    f"<profiles><publisher profile_name='/tf'>{POLICY}</publisher></profiles>",
    '<!DOCTYPE dds [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><dds><profiles>&b;</profiles></dds>',
    "<dds>" + "<a>" * 200 + "</a>" * 200 + "</dds>",
    "<dds>" + " " * (1 << 20) + "</dds>",
    "<robot/>",
    "<dds><profiles></dds>",
    '<?xml version="1.0" encoding="none-such"?><dds/>',
    "",
)


@pytest.mark.parametrize(
    ("remap", "env", "names"),
    [
        ({}, {"RMW_IMPLEMENTATION": "rmw_x"}, ["rmw_fastrtps_cpp", "rmw_x"]),
        ({"/tf": "tf"}, {}, [" tf", "slash"]),
        ({}, {"FASTRTPS_DEFAULT_PROFILES_FILE": "/no/such.xml"}, ["/no/such.xml", "fence: remap"]),
        ({}, {"FASTRTPS_DEFAULT_PROFILES_FILE": "/dev/zero"}, ["/dev/zero", "fence: remap"]),
        *(
            ({}, {"FASTRTPS_DEFAULT_PROFILES_FILE": text}, ["own.xml", "fence: remap"])
            for text in BAD_PROFILES
        ),
    ],
)
def test_what_a_partition_cannot_fence_off_is_one_finding_that_names_all(
    tmp_path: Path, remap: dict[str, str], env: dict[str, str], names: list[str]
) -> None:
    own_profile = tmp_path / "own.xml"
    for name, value in env.items():
        if value in BAD_PROFILES:
            own_profile.write_text(value)
            env = {name: str(own_profile)}
    both = [
        PlanProcess(name, "run", argv=("true",), remap=remap, owns=(("map", name),))
        for name in ("slam", "drive")
    ]
    _, (finding,) = inspect(tmp_path, *both, fence="partition", **env)
    expect(finding, "TF902", *names)
    assert {"slam", "drive"} <= set(re.findall(r"\w+", finding.message))


OWN = "FASTRTPS_DEFAULT_PROFILES_FILE"


@pytest.mark.parametrize(
    ("argv", "names"),
    [
        (("/bin/sh", "-c", f"export {OWN}='/opt/my.xml'; exec drive"), [OWN, "/opt/my.xml"]),
        (("/bin/sh", "-c", f"unset {OWN}; exec drive"), [OWN]),
        (("env", f"{OWN}=/opt/my.xml", "drive"), [OWN, "/opt/my.xml"]),
        (("env", "-u", OWN, "drive"), [OWN]),
    ],
)
def test_an_owner_whose_command_names_a_profile_by_itself_is_not_started(
    tmp_path: Path, argv: tuple[str, ...], names: list[str]
) -> None:
    drive = replace(SLAM, name="drive", argv=argv)
    _, (finding,) = inspect(tmp_path, drive, GUARD, fence="partition")
    expect(finding, "TF902", "drive", "fence: remap", *names)
    assert ("/opt/my.xml}" in finding.help) is ("/opt/my.xml" in names)
    assert inspect(tmp_path, replace(drive, owns=()), GUARD, fence="partition")[1] == [], (
        "who may send no TF at all"
    )


# By remapping.


def test_another_rmw_is_fenced_off_by_remapping(tmp_path: Path) -> None:
    static = PlanProcess("static", "static", argv=(PROGRAM, "static", "${plan}", "static"))
    commands, findings = inspect(
        tmp_path, SLAM, static, GUARD, RMW_IMPLEMENTATION="rmw_cyclonedds_cpp"
    )
    assert findings == []
    for name in ("slam", "static"):
        assert moved(commands[name]) == {
            "/tf": f"/_tfcompose/rover/{name}/tf",
            "/tf_static": f"/_tfcompose/rover/{name}/tf_static",
        }
        assert commands[name].fence is None
    assert REMAPPED in commands["guard"].env
    assert commands["guard"].argv[1:] == ()


def test_the_way_can_be_chosen(tmp_path: Path) -> None:
    commands, _ = inspect(tmp_path, SLAM, GUARD, fence="remap")
    assert moved(commands["slam"])
    assert commands["slam"].fence is None
    assert inspect(tmp_path, SLAM, GUARD)[0]["slam"].fence


def test_fence_remappings_precede_the_plans_and_catch_its_topics(
    tmp_path: Path,
) -> None:
    argv = (
        "true",
        "--speed",
        "3",
        "--ros-args",
        "-r",
        "__node:=slam",
        "-r",
        "/tf:=/r/tf",
        "-p",
        "a:=1",
    )
    remap = {"/tf": "/r/tf", "/tf_static": "/r/tf_static"}
    slam = PlanProcess(
        "slam", "run", argv=argv, nodes=("/r/slam",), remap=remap, owns=(("map", "odom"),)
    )
    commands, _ = inspect(tmp_path, slam, GUARD, fence="remap")
    words = commands["slam"].argv[1:]
    assert words[:3] == ("--speed", "3", "--ros-args")
    assert words[-6:] == ("-r", "__node:=slam", "-r", "/tf:=/r/tf", "-p", "a:=1")
    private = {
        "/tf": "/_tfcompose/rover/slam/tf",
        "/tf_static": "/_tfcompose/rover/slam/tf_static",
    }
    assert moved(commands["slam"]) == {
        **private,
        "/r/tf": private["/tf"],
        "/r/tf_static": private["/tf_static"],
        "__node": "slam",
    }


def test_a_launch_file_is_remapped_in_full(tmp_path: Path) -> None:
    share = tmp_path / "share" / "nav"
    share.mkdir(parents=True)
    (share / "nav.launch.py").write_text("")
    ros2 = tmp_path / "ros2"
    ros2.write_text("")
    ros2.chmod(0o755)
    argv = ("${launch:nav/nav.launch.py}", "a:=1")
    nav = PlanProcess("nav", "run", argv=argv, remap={"/scan": "/front/scan"}, owns=(("a", "b"),))
    env = {"PATH": str(tmp_path), "AMENT_PREFIX_PATH": str(tmp_path)}
    commands, findings = inspect(tmp_path, nav, fence="remap", **env)
    assert findings == []
    launch = json.loads(commands["nav"].env[LAUNCH])
    topics = {"/tf": "/_tfcompose/rover/nav/tf", "/tf_static": "/_tfcompose/rover/nav/tf_static"}
    assert launch["remap"] == topics | {"/scan": "/front/scan"}
    assert launch["arguments"] == {"a": "1"}


def test_owners_that_no_remapping_reaches_are_one_finding(tmp_path: Path) -> None:
    shell = PlanProcess(
        "shell",
        "run",
        argv=("/bin/sh", "-c", "drive | tee log"),
        nodes=("/a",),
        owns=(("a", "b"),),
    )
    more = replace(shell, name="more", nodes=("/b",), owns=(("b", "c"),))
    _, (finding,) = inspect(tmp_path, shell, more, SLAM, GUARD, fence="remap")
    expect(finding, "TF902", "shell, more")


def test_a_command_that_may_be_no_node_gets_no_ros_arguments(tmp_path: Path) -> None:
    web = PlanProcess("web", "run", argv=("true", "--port", "80"), nodes=("/web",))
    play = PlanProcess("play", "run", argv=("true", "--ros-args", "-p", "a:=1"), nodes=("/play",))
    commands, findings = inspect(tmp_path, web, play, SLAM, GUARD, fence="remap")
    assert findings == []
    assert commands["web"].argv[1:] == ("--port", "80")
    assert moved(commands["play"])


@given(
    st.lists(
        st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,6}(/[A-Za-z][A-Za-z0-9_]{0,6})?", fullmatch=True),
        unique=True,
    )
)
def test_every_process_has_topics_of_its_own_with_names_that_ros_takes(names: list[str]) -> None:
    processes = (PlanProcess(name, "run", argv=("true",), owns=(("map", name),)) for name in names)
    topics = private_topics(plan_of(*processes, GUARD)).values()
    each: list[Any] = list(chain(*topics))
    assert len(set(each)) == 2 * len(names)
    for topic in each:
        assert re.fullmatch(r"(/_?[A-Za-z](_?[A-Za-z0-9])*)+", topic)
