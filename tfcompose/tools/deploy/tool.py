"""The tool ``deploy``: it installs a robot on several computers over ssh."""

from tfcompose.foundation.tool import Command, Option, Tool, Topic

TOOL = Tool(
    name="deploy",
    package=__package__,
    commands=(
        Command(
            "deploy",
            "Copy a robot to its computers, and start it there",
            "tfcompose.tools.deploy.command",
            group="Ship",
            completes=(("hosts", "hosts"),),
        ),
    ),
    codes=__package__,
    topics=(Topic("hosts", "a robot on several computers, and `deploy`", group="Integration"),),
    options=(
        Option(
            ("ps", "logs", "events", "down"),
            ("--all-hosts", "--file"),
            "tfcompose.tools.deploy.option",
        ),
    ),
    extra="deploy",
)
