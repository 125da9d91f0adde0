"""What ``up`` prints of a process that fails: its last lines once, and the cause at the end."""

from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in
from tfcompose.cli.commands import tree
from tfcompose.cli.console import Console
from tfcompose.foundation.findings import Note, finding
from tfcompose.model.messages import Ended, FindingShown, LogLine, Replanned
from tfcompose.model.plan import OutputPlace, Plan, PlanProcess, RosSettings

PLAN = Plan("rover", "", None, RosSettings(), (), (PlanProcess("drive", "run"),))
FAILED = finding(
    "TF808",
    "drive ended with exit code 1",
    None,
    notes=[Note("drive: boom"), Note("it ran for 2 s")],
)
ROBOTS = Path(__file__).parents[2] / "robots"


class Printed:
    """Keeps what is written."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str, *, log: bool = False) -> None:
        del log
        self.text += text


def test_lines_that_were_printed_are_not_quoted_again() -> None:
    output = Printed()
    console = Console(PLAN, output, colour=False)
    for notice in (
        LogLine("drive", "stderr", "boom"),
        FindingShown(FAILED),
        Ended(1, ("drive ended", "drive: boom")),
    ):
        console(notice)
    assert output.text.count("boom") == 1
    assert "it ran for 2 s" in output.text
    assert output.text.count("drive ended") == 2


def test_lines_that_were_not_printed_are_quoted() -> None:
    output = Printed()
    Console(PLAN, output, colour=False)(FindingShown(FAILED))
    assert output.text.count("boom") == 1


def test_names_of_any_length_align_also_of_processes_that_are_new() -> None:
    output = Printed()
    console = Console(PLAN, output, colour=False)
    console(Replanned((), ("the_driver_of_a_camera_with_a_long_name",), ()))
    console(LogLine("the_driver_of_a_camera_with_a_long_name", "stdout", "a"))
    console(LogLine("drive", "stdout", "b"))
    assert len({line.index("|") for line in output.text.splitlines()}) == 1


def test_a_tree_on_a_terminal_shows_each_frame_in_place_and_does_not_wrap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    full = tfcompose_in(ROBOTS, "tree", "autonomous_robot.yaml").stdout.splitlines()
    monkeypatch.setattr(tree, "table_width", lambda _stream: 80)
    fitted = tfcompose_in(ROBOTS, "tree", "autonomous_robot.yaml").stdout.splitlines()
    assert max(map(len, full)) > 80 > max(map(len, fitted))
    names, fitted_names = (
        [line.split("── ")[1].split()[0] for line in lines if "── " in line]
        for lines in (full, fitted)
    )
    assert fitted_names == names


def test_a_process_writes_to_the_terminal_or_its_log_as_output_says() -> None:
    outputs: tuple[OutputPlace, ...] = ("both", "log", "screen")
    processes = tuple(PlanProcess(f"to_{place}", "run", output=place) for place in outputs)
    output, kept = Printed(), dict[str, str]()
    plan = Plan("rover", "", None, RosSettings(), (), processes)
    console = Console(
        plan, output, colour=False, keep=lambda name, text: kept.update({name: text})
    )
    for process in processes:
        console(LogLine(process.name, "stdout", f"line of {process.name}"))
    assert kept == {name: f"line of {name}" for name in ("to_both", "to_log")}
    assert [
        name for name in ("to_both", "to_log", "to_screen") if f"line of {name}" in output.text
    ] == [
        "to_both",
        "to_screen",
    ]
