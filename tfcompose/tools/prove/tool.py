"""Prove tool: declared mounts against what sensors measure."""

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
