"""The tool ``view``: a robot in the browser."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="view",
    package=__package__,
    commands=(
        Command(
            "view",
            "Show a robot in the browser, and edit its mounts",
            "tfcompose.tools.view.command",
            group="Look",
        ),
    ),
    extra="view",
)
