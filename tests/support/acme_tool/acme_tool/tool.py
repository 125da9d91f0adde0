"""Acme tool: what it adds to tfcompose."""

from tfcompose.foundation.tool import Command, Key, Language, Option, Tool, Topic

TOOL = Tool(
    name="acme",
    package="acme_tool",
    commands=(
        Command("acme", "List the frames that hear a robot's beeper", "acme_tool.command"),
        Command("beep", "Beep as the robot's plan says", "acme_tool.beep"),
    ),
    codes="acme_tool",
    topics=(Topic("acme", "beepers, and who hears them"),),
    keys=(
        Key(
            "acme",
            "acme_tool.spec:AcmeSpec",
            "the robot's beeper",
            ({"frame": "base_link", "reach": "2 m"},),
            processes="acme_tool.spec:beeper",
            check="acme_tool.spec:far_beeper",
            rules="acme_tool.rules",
            in_plan=True,
        ),
    ),
    languages=(Language("beepers", "acme_tool.spec:BeepersSpec", "The language of beepers"),),
    preflight="acme_tool.preflight:muted",
    options=(Option(("tree",), ("--beeper",), "acme_tool.option"),),
)
