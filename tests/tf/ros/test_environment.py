import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.support import processes
from tfcompose.model.plan import RosSettings
from tfcompose.tf.ros.environment import (
    FASTDDS_PROFILE,
    FASTDDS_PROFILE_LOCALHOST,
    child_environment,
    installed_distro,
    missing_ros,
    other_distro,
    other_middleware,
    ros_trouble,
)

SPACE = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"


def test_what_the_plan_says_reaches_the_process() -> None:
    environment = child_environment(
        {"HOME": "/root", "ROS_DOMAIN_ID": "3"}, RosSettings("", 7, "localhost"), is_built_in=False
    )
    assert environment == {
        "HOME": "/root",
        "ROS_DOMAIN_ID": "7",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONUNBUFFERED": "1",
    }


def test_what_the_plan_leaves_open_stays_as_it_is() -> None:
    base = {"ROS_DOMAIN_ID": "3", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    assert child_environment(base, RosSettings(), is_built_in=False) == base | {
        "PYTHONUNBUFFERED": "1"
    }


def test_own_processes_announce_themselves_by_the_packaged_profile() -> None:
    environment = child_environment({}, RosSettings(), is_built_in=True)
    assert environment["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(FASTDDS_PROFILE)
    for base, ros in (
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, RosSettings()),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, RosSettings(discovery="localhost")),
    ):
        environment = child_environment(base, ros, is_built_in=True)
        assert environment["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(FASTDDS_PROFILE_LOCALHOST)


@pytest.mark.parametrize(
    "name", ["FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"]
)
def test_a_profile_that_the_user_set_stays(name: str) -> None:
    environment = child_environment({name: "/etc/mine.xml"}, RosSettings(), is_built_in=True)
    assert {key: value for key, value in environment.items() if "PROFILES" in key} == {
        name: "/etc/mine.xml"
    }


@pytest.mark.parametrize(
    ("file", "period_ns"),
    [(FASTDDS_PROFILE, 250_000_000), (FASTDDS_PROFILE_LOCALHOST, 100_000_000)],
)
def test_the_profile_announces_at_4_hz_and_on_one_machine_at_10_hz(
    file: Path, period_ns: int
) -> None:
    config = next(ET.parse(file).iter(f"{SPACE}discovery_config"))  # noqa: S314 (a file of ours)
    values = {element.tag.removeprefix(SPACE): element.text for element in config.iter()}
    announced = config.find(f"{SPACE}leaseAnnouncement/{SPACE}nanosec")
    assert values["count"] == "20"
    assert announced is not None
    assert announced.text == str(period_ns)


def test_without_rclpy_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tfcompose.tf.ros.environment.find_spec", lambda _: None)
    sentence = missing_ros() or ""
    assert "pip install 'tfcompose[ros]'" in sentence
    assert "/opt/ros/jazzy/setup.bash" in sentence
    assert "\n" not in sentence


def test_the_parts_that_need_no_ros_import_none() -> None:
    names = ["environment", "joint_codec", "processes", "tf_codec"]
    code = "import sys; " + "; ".join(f"import tfcompose.tf.ros.{name}" for name in names)
    code += (
        "; import tfcompose.launcher.publishers.simulate, tfcompose.guard.start;"
        " sys.exit('rclpy' in sys.modules)"
    )
    assert processes.run([sys.executable, "-c", code]).returncode == 0


def test_other_middlewares_get_no_profile_of_fast_dds() -> None:
    for ros, base in (
        (RosSettings(rmw="cyclonedds"), {}),
        (RosSettings(rmw="zenoh"), {}),
        (RosSettings(), {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}),
    ):
        environment = child_environment(base, ros, is_built_in=True)
        assert not [name for name in environment if "PROFILES" in name]
    assert child_environment(
        {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, RosSettings(rmw="fastdds"), is_built_in=True
    ) == {
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "PYTHONUNBUFFERED": "1",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(FASTDDS_PROFILE),
    }


def test_a_missing_middleware_is_named_as_in_the_robot_file() -> None:
    ros = RosSettings(rmw="zenoh")
    finding = ros_trouble(child_environment({}, ros, is_built_in=True), ros)
    assert finding is not None
    assert (finding.code, "rmw: zenoh" in finding.message, "rmw_zenoh_cpp" in finding.message) == (
        "TF901",
        True,
        True,
    )
    assert "ros-jazzy-rmw-zenoh-cpp" in finding.help


def test_other_middlewares_need_tf2_msgs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tfcompose.tf.ros.environment.ctypes.CDLL", lambda _: None)
    monkeypatch.setattr(
        "tfcompose.tf.ros.environment.find_spec", lambda name: None if name == "tf2_msgs" else name
    )
    assert ros_trouble({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}) is None
    finding = ros_trouble({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"})
    assert finding is not None
    assert (finding.code, "tf2_msgs" in finding.message) == ("TF901", True)


def test_a_configuration_of_zenoh_that_is_not_there_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tfcompose.tf.ros.environment.ctypes.CDLL", lambda _: None)
    monkeypatch.setattr("tfcompose.tf.ros.environment.find_spec", lambda name: name)
    file = tmp_path / "session.json5"
    environment = {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp", "ZENOH_SESSION_CONFIG_URI": str(file)}
    finding = ros_trouble(environment)
    assert finding is not None
    assert (finding.code, str(file) in finding.message) == ("TF909", True)
    assert ros_trouble({**environment, "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}) is None
    file.touch()
    assert ros_trouble(environment) is None


@pytest.mark.parametrize(
    ("here", "warned"), [("rmw_fastrtps_cpp", True), ("rmw_zenoh_cpp", False), ("", False)]
)
def test_an_environment_with_another_middleware_is_warned_of(here: str, *, warned: bool) -> None:
    finding = other_middleware({"RMW_IMPLEMENTATION": here}, RosSettings(rmw="zenoh"))
    assert (finding is not None) == warned
    if finding:
        assert (finding.code, finding.severity) == ("TF909", "warning")
    assert other_middleware({"RMW_IMPLEMENTATION": here}, RosSettings()) is None


@pytest.mark.parametrize(("here", "warned"), [("jazzy", True), ("kilted", False)])
def test_another_release_of_ros_than_the_robots_is_warned_of(here: str, *, warned: bool) -> None:
    finding = other_distro({"ROS_DISTRO": here}, RosSettings(distro="kilted"))
    assert (finding is not None) == warned
    if finding:
        assert (finding.code, finding.severity, "Jazzy" in finding.message) == (
            "TF909",
            "warning",
            True,
        )
    assert other_distro({"ROS_DISTRO": here}, RosSettings()) is None


def test_without_a_variable_the_release_is_that_of_rclpy(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"ros-rclpy": "9.1.2"}

    def version(name: str) -> str:
        if name not in versions:
            raise PackageNotFoundError
        return versions[name]

    monkeypatch.setattr("tfcompose.tf.ros.environment.version", version)
    assert installed_distro({}) == "kilted"
    versions["rclpy"] = "7.1.6"
    assert installed_distro({}) == "jazzy"
    versions.clear()
    assert installed_distro({}) is None


def test_advice_names_the_packages_of_the_robots_release() -> None:
    ros = RosSettings(rmw="zenoh", distro="kilted")
    finding = ros_trouble(child_environment({}, ros, is_built_in=True), ros)
    assert finding is not None
    assert "ros-kilted-rmw-zenoh-cpp" in finding.help
