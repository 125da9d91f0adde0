"""Acme tool: what it adds to tfcompose."""

from tfcompose.foundation.tool import Command, Key, Tool, Topic

TOOL = Tool(
    name="acme",
    package="acme_tool",
    commands=(Command("acme", "List the frames that hear a robot's beeper", "acme_tool.command"),),
    codes="acme_tool",
    topics=(Topic("acme", "beepers, and who hears them"),),
    keys=(
        Key(
            "acme",
            "acme_tool.spec:AcmeSpec",
            "the robot's beeper",
            ({"frame": "base_link", "reach": "2 m"},),
            processes="acme_tool.spec:beeper",
            rules="acme_tool.rules",
        ),
    ),
)
