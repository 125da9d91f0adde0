"""Record tool: a running robot's transforms, joint states and clock in a bag."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="record",
    package=__package__,
    commands=(
        Command(
            "record",
            "Record the transforms and joint states of a running robot",
            "tfcompose.tools.record.command",
            group="Run",
        ),
    ),
    extra="bag",
)
