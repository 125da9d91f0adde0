"""Adjust tool: mounts of the running robot, and calibrations of single robots in overlays."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="adjust",
    package=__package__,
    commands=(
        Command(
            "nudge",
            "Move a mount of the running robot, without a restart",
            "tfcompose.tools.adjust.nudge",
            group="Run",
            completes=(("mount", "sensors"),),
        ),
        Command(
            "calibrate",
            "Write a measured mount into the overlay of one robot",
            "tfcompose.tools.adjust.calibrate",
            group="Run",
            completes=(("sensor", "sensors"),),
        ),
    ),
    codes=__package__,
)
