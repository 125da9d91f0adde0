"""The tool ``import``: robot files from URDF, launch files, scripts or a running robot."""

from tfcompose.foundation.tool import Command, Tool

TOOL = Tool(
    name="import",
    package=__package__,
    commands=(
        Command(
            "import",
            "Write a robot file from URDF, launch files, scripts or a running robot",
            "tfcompose.tools.importers.command",
            group="Write",
        ),
        Command(
            "adopt",
            "Guard a robot that keeps its launch files, and take its fixed edges one by one",
            "tfcompose.tools.importers.adopt",
            group="Write",
        ),
    ),
    codes=__package__,
)
