"""Which tests may be skipped where all is installed that this project's own environment installs.

``python -m tests.support.skips`` prints those that need stock parts of ROS, for a run beside them.
"""

from collections.abc import Collection, Iterable

from _pytest.reports import BaseReport

_LAUNCH = "launch comes with a distribution only, and reads launch files"
#: The beginning of a test's id, and why nothing is lost.
NEEDS_STOCK_ROS = {
    "tests/tf/tf2/test_tf2_oracle.py": (
        "tf2_py comes with a distribution only; tf2_answers.jsonl holds its answers"
    ),
    "tests/launcher/test_moved_mount_ros.py": "tf2_ros comes with a distribution only",
    "tests/launcher/test_launch_file_ros.py": "ros2 launch comes with a distribution only",
    "tests/tools/exporters/test_exports_ros.py::"
    "test_ros2_launch_starts_the_tree_of_the_plan_with_stock_nodes": (
        "ros2 launch comes with a distribution only"
    ),
    "tests/tools/exporters/test_launch_formats_ros.py": _LAUNCH,
    "tests/launcher/test_components_ros.py::"
    "test_the_containers_of_rclcpp_components_load_a_component": (
        "stock containers come with a distribution only; a stand-in loads components"
    ),
    "tests/tools/importers/test_adopt_ros.py": (
        "static_transform_publisher comes with a distribution only"
    ),
    "tests/tools/importers/test_real_launch.py": _LAUNCH,
    "tests/tools/importers/test_launch.py": _LAUNCH,
    "tests/tools/importers/test_confined_launch.py": _LAUNCH,
    "tests/tools/importers/test_exported.py": _LAUNCH,
    "tests/tools/ros2/test_colcon.py": "colcon and the ros2 command come with a distribution only",
    "tests/tools/ros2/test_init_package_ros.py": (
        "colcon and the ros2 command come with a distribution only"
    ),
    "tests/tools/adjust/test_nudge_stock_ros.py": "there is no robot_state_publisher",
    "tests/tools/ros2/test_launch_ros.py": "ros2 launch comes with a distribution only",
    "tests/guard/test_plan_parameters_ros.py::test_ros2_param_reads_them": (
        "ros2 param comes with a distribution only; clients of rclpy read the same"
    ),
    "tests/tools/ros2/test_verb.py": "the ros2 command comes with a distribution only",
}
ACCEPTED = NEEDS_STOCK_ROS | {
    "tests/launcher/test_components_ros.py": "the services are built with a C compiler",
    "tests/tools/importers/test_round_trip.py::test_every_robot_that_is_listed": (
        "pybullet_data is not on every Python"
    ),
    "tests/guard/adversary/test_rogues_ros.py::test_a_program_of_another_dds": (
        "cyclonedds is not on every Python"
    ),
    "tests/tools/view/test_browser_live_ros.py": "as below",
    "tests/tools/deploy/test_deploy_ros.py": (
        "sshd is no Python package: .ci/run installs Debian's, or says that it cannot; "
        "and a container may not be allowed to make networks"
    ),
    "tests/tools/view/test_browser.py": (
        "Chromium is no Python package: .ci/run installs Debian's, or says that it cannot"
    ),
    "tests/cli/test_completion.py::test_a_shell_on_a_terminal": (
        "zsh and fish are no Python packages: .ci/run installs Debian's, or says that it cannot"
    ),
    "tests/test_release.py": "bloom is in another environment: .ci/run runs these tests with it",
    "tests/cli/test_bad_input.py::test_what_cannot_be_read": "root may read everything",
}


def unexpected(skipped: Iterable[BaseReport], accepted: Collection[str]) -> list[str]:
    """Return the ids of the tests that were skipped and may not be, with the reasons they give."""
    return [
        f"{report.nodeid}:"
        f" {report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr}"
        for report in skipped
        if not report.nodeid.startswith(tuple(accepted))
    ]


if __name__ == "__main__":
    print(*NEEDS_STOCK_ROS, sep="\n")  # noqa: T201 (for a shell)
