"""The tool ``prove``: it compares declared mounts with measurements of sensors."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="prove",
    package=__package__,
    commands=(
        Command(
            "prove",
            "Compare declared mounts with what sensors measure",
            "tfcompose.tools.prove.command",
            group="Run",
            completes=(("sensors", "sensors"),),
        ),
    ),
    codes=__package__,
    extra="prove",
)
