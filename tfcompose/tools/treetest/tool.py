"""Test tool: expectations of a robot's transform tree, judged on recordings or started robots."""

from tfcompose.foundation.tool import Command, Language, Option, Tool, Topic
from tfcompose.tools.treetest import ENDINGS

TOOL = Tool(
    name="test",
    package=__package__,
    commands=(
        Command(
            "test",
            "Check a robot, started or recorded, against the expectations in a test file",
            "tfcompose.tools.treetest.command",
            group="Check",
            topic="testing",
        ),
    ),
    codes=__package__,
    topics=(Topic("testing", "tests of a transform tree, started or recorded", group="Commands"),),
    languages=(
        Language(
            "test",
            "tfcompose.tools.treetest.spec:SuiteSpec",
            "The language of test files",
            endings=ENDINGS,
            check="tfcompose.tools.treetest.cases:check_file",
        ),
    ),
    options=(
        Option(("init",), ("--tests", "--bag", "--profile"), "tfcompose.tools.treetest.option"),
    ),
    extra="bag",
)
