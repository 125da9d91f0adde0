"""The tool ``rebag``: it rewrites or plays recordings with the poses of a robot file."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="rebag",
    package=__package__,
    commands=(
        Command(
            "rebag",
            "Copy a recording with the poses of a robot file",
            "tfcompose.tools.rebag.command",
            group="Ship",
        ),
        Command(
            "play",
            "Play a recording with the fixed edges of a robot file",
            "tfcompose.tools.rebag.play",
            group="Ship",
        ),
    ),
    codes=__package__,
    extra="bag",
)
