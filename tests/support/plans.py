"""A robot's text as its plan and files, for tests of what is made of plans."""

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan import Plan
from tfcompose.model.plan.file import read_plan


def built(text: str, *profiles: str) -> dict[str, str]:
    """Return the files that a right robot is built to."""
    compiled = compile_robot(text, "robot.yaml", library(), list(profiles))
    assert compiled.robot, compiled.findings
    assert not compiled.errors, compiled.findings
    return {file.path: file.text for file in emit(compiled.robot)}


def compiled_plan(text: str, *profiles: str) -> Plan:
    """Return the plan of a right robot."""
    return read_plan(built(text, *profiles)["plan.json"], "plan.json")
