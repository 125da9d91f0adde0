"""The tool for ROS: the verb ``ros2 tfcompose``, colcon packages, and launch files."""

from tfcompose.foundation.tool import Option, Tool, Topic

TOOL = Tool(
    name="ros2",
    package=__package__,
    options=(Option(("init",), ("--package", "--cmake"), "tfcompose.tools.ros2.option"),),
    topics=(
        Topic("ros2", "colcon, `ros2 tfcompose`, and launch files", group="Integration"),
        Topic(
            "nodes",
            "in ROS's words: topics, QoS, lifecycle, diagnostics and REPs",
            group="Integration",
        ),
    ),
)
