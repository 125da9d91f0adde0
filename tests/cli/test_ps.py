"""What ``ps`` makes of a robot's findings: its lines, its JSON and its exit code."""

import json

import pytest
from msgspec.structs import replace

from tests.golden.test_views import STATUS, process
from tfcompose.cli.commands import ps
from tfcompose.cli.parser import main
from tfcompose.foundation.findings import finding
from tfcompose.model.messages import RobotStatus

SOUND = replace(STATUS, complete=True, processes=(process("static", "running", pid=7_000_001),))
ERROR = finding("TF801", "/rogue publishes odom → base_link", None)
WARNING = finding("TF861", "/rogue sends arm_jiont", None)
FAILED = replace(SOUND, processes=(process("camera", "fatal", failed=True),))


def test_the_overlays_are_in_the_table_and_in_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status = replace(SOUND, overlays=("overlays/ant.yaml",))
    monkeypatch.setattr(ps, "_robots", lambda _: ({"rover@0": status}, 0))
    assert main(["ps"]) == 0
    assert "overlays/ant.yaml" in capsys.readouterr().out
    assert main(["ps", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["overlays"] == ["overlays/ant.yaml"]


@pytest.mark.parametrize(
    ("status", "codes"),
    [
        pytest.param(None, (0, 1, 1, 1), id="no robot"),
        pytest.param(SOUND, (0, 0, 0, 0), id="sound"),
        pytest.param(replace(SOUND, findings=(WARNING,)), (0, 0, 1, 0), id="a warning"),
        pytest.param(replace(SOUND, findings=(ERROR, WARNING)), (0, 0, 1, 1), id="an error"),
        pytest.param(FAILED, (0, 0, 1, 1), id="a failed process"),
    ],
)
def test_scripts_choose_what_makes_the_exit_code(
    status: RobotStatus | None, codes: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    robots = {} if status is None else {"rover@0": status}
    monkeypatch.setattr(ps, "_robots", lambda _: (robots, 0))
    options: tuple[list[str], ...] = (
        [],
        ["--fail-on", "absent"],
        ["--fail-on", "warning"],
        ["--fail-on", "error"],
    )
    for format_ in ("text", "json"):
        exit_codes = tuple(main(["ps", "--format", format_, *words]) for words in options)
        assert exit_codes == codes


def test_findings_are_listed_and_in_the_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status = replace(SOUND, findings=(ERROR, WARNING))
    monkeypatch.setattr(ps, "_robots", lambda _: ({"rover@0": status}, 0))
    main(["ps"])
    head, first, second, *_ = capsys.readouterr().out.splitlines()
    assert "1 error and 1 warning" in head
    assert ("TF801" in first, "TF861" in second) == (True, True)
    main(["ps", "--format", "json"])
    (robot,) = json.loads(capsys.readouterr().out)
    assert [entry["code"] for entry in robot["findings"]] == ["TF801", "TF861"]
