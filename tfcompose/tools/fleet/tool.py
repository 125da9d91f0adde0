"""The tool ``fleet``: poses between robots, over Zenoh."""

from tfcompose.foundation.tool import Command, Key, Language, Tool, Topic

TOOL = Tool(
    name="fleet",
    package=__package__,
    commands=(
        Command(
            "fleet",
            "Share edges between robots over Zenoh, and look poses up between them",
            "tfcompose.tools.fleet.command",
            group="Ship",
        ),
    ),
    codes=__package__,
    topics=(Topic("fleet", "poses between several robots, over Zenoh", group="Integration"),),
    keys=(
        Key(
            "fleet",
            "tfcompose.tools.fleet.spec:Member",
            "the fleet that this robot shares edges with",
            ("fleet.yaml", {"file": "fleet.yaml", "robot": "r1"}),
            processes="tfcompose.tools.fleet.membership:share_process",
            check="tfcompose.tools.fleet.membership:wrong_membership",
        ),
    ),
    languages=(
        Language("fleet", "tfcompose.tools.fleet.spec:FleetSpec", "The language of fleet files"),
    ),
    extra="fleet",
    preflight="tfcompose.tools.fleet.preflight:missing_zenoh",
)
