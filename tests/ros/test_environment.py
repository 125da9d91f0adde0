import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.support import processes
from tfcompose.plan import RosSettings
from tfcompose.ros.environment import (
    FASTDDS_PROFILE,
    FASTDDS_PROFILE_LOCALHOST,
    child_environment,
    missing_ros,
)

SPACE = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"


def test_what_the_plan_says_reaches_the_process() -> None:
    found = child_environment({"HOME": "/root", "ROS_DOMAIN_ID": "3"}, RosSettings("", 7, "localhost"), own=False)
    assert found == {
        "HOME": "/root",
        "ROS_DOMAIN_ID": "7",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONUNBUFFERED": "1",
    }


def test_what_the_plan_leaves_open_stays_as_it_is() -> None:
    base = {"ROS_DOMAIN_ID": "3", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    assert child_environment(base, RosSettings(), own=False) == base | {"PYTHONUNBUFFERED": "1"}


def test_own_processes_announce_themselves_by_the_packaged_profile() -> None:
    found = child_environment({}, RosSettings(), own=True)
    assert found["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(FASTDDS_PROFILE)
    for base, ros in (
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, RosSettings()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, RosSettings(discovery="localhost")),
    ):
        found = child_environment(base, ros, own=True)
        assert found["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(FASTDDS_PROFILE_LOCALHOST)


@pytest.mark.parametrize("name", ["FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"])
def test_a_profile_that_the_user_set_stays(name: str) -> None:
    found = child_environment({name: "/etc/mine.xml"}, RosSettings(), own=True)
    assert {key: value for key, value in found.items() if "PROFILES" in key} == {name: "/etc/mine.xml"}


@pytest.mark.parametrize(
    ("file", "period_ns"), [(FASTDDS_PROFILE, 250_000_000), (FASTDDS_PROFILE_LOCALHOST, 100_000_000)]
)
def test_the_profile_announces_four_times_a_second_and_on_one_machine_ten_times(file: Path, period_ns: int) -> None:
    config = next(ET.parse(file).iter(f"{SPACE}discovery_config"))  # noqa: S314 (a file of ours)
    values = {element.tag.removeprefix(SPACE): element.text for element in config.iter()}
    announced = config.find(f"{SPACE}leaseAnnouncement/{SPACE}nanosec")
    assert values["count"] == "20"
    assert announced is not None
    assert announced.text == str(period_ns)


def test_without_rclpy_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tfcompose.ros.environment.find_spec", lambda _: None)
    sentence = missing_ros() or ""
    assert "pip install 'tfcompose[ros]'" in sentence
    assert "/opt/ros/jazzy/setup.bash" in sentence
    assert "\n" not in sentence


def test_the_parts_that_need_no_ros_import_none() -> None:
    names = ["environment", "joint_codec", "processes", "tf_codec"]
    code = "import sys; " + "; ".join(f"import tfcompose.ros.{name}" for name in names)
    code += "; import tfcompose.publishers.simulate, tfcompose.guard.__main__; sys.exit('rclpy' in sys.modules)"
    assert processes.run([sys.executable, "-c", code]).returncode == 0
