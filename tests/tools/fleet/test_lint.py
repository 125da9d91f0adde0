"""The file of a fleet, and what is wrong with it."""

import sys
from pathlib import Path

import pytest

from tests.support import processes
from tfcompose.cli import main
from tfcompose.foundation.findings import RejectedError
from tfcompose.spec.load import load
from tfcompose.tools.fleet.check import check_fleet
from tfcompose.tools.fleet.spec import validate_fleet

SOUND = """fleet: 1
share:
  - map → odom
  - {edge: odom -> base_link, rate: 5 Hz}
robots:
  r1: {router: "tcp/10.0.0.11:7447"}
  r2: {router: "tls/robot-2.local:7447", share: [map → base_link], namespace: robot2}
"""


def places_of(text: str) -> list[tuple[str, int]]:
    source = load(text, "fleet.yaml")
    try:
        findings = list(check_fleet(validate_fleet(source), source))
    except RejectedError as error:
        findings = list(error.findings)
    return sorted((finding.code, finding.span.line if finding.span else 0) for finding in findings)


def test_a_sound_fleet_has_edges_with_rates_and_names_of_its_own() -> None:
    assert places_of(SOUND) == []
    fleet = validate_fleet(load(SOUND, "fleet.yaml"))
    assert [(edge.ends, edge.rate) for edge in fleet.edges_of("r1")] == [
        (("map", "odom"), 5.0),
        (("odom", "base_link"), 5.0),
    ]
    assert [edge.ends for edge in fleet.edges_of("r2")] == [("map", "base_link")]
    assert [fleet.final("r2", name) for name in ("map", "odom", "r2/odom")] == [
        "map",
        "r2/odom",
        "r2/odom",
    ]


@pytest.mark.parametrize(
    "text", ["odom → base_link at 2 Hz", "odom->base_link  at  2", "odom -> base_link at 2Hz"]
)
def test_the_rate_may_stand_behind_the_edge(text: str) -> None:
    fleet = validate_fleet(
        load(SOUND.replace("{edge: odom -> base_link, rate: 5 Hz}", text), "fleet.yaml")
    )
    assert [(edge.ends, edge.rate) for edge in fleet.edges_of("r1")][1] == (
        ("odom", "base_link"),
        2.0,
    )


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("tcp/10.0.0.11:7447", "10.0.0.11", [("TF106", 6)]),
        ("map → odom", "map odom", [("TF106", 3)]),
        ("rate: 5 Hz", "rate: 5 m", [("TF104", 4)]),
        ("map → odom", "map → odom at 5 m", [("TF104", 3)]),
        ("map → odom", "map → odom at", [("TF106", 3)]),
        ("map → odom", "{edge: map → odom at 5 Hz}", [("TF106", 3)]),
        ("router:", "ruter:", [("TF101", 6)]),
        ("namespace: robot2", "prefix: r1/", [("TF880", 7)]),
        ("share: [map → base_link]", "share: []", [("TF881", 7)]),
        ("share: [map → base_link]", "share: [odom → base_link]", [("TF881", 7)]),
        ("  - map → odom", "  - map → odom\n  - earth → odom", [("TF880", 4)]),
    ],
)
def test_what_is_wrong_is_found_at_its_place(
    old: str, new: str, expected: list[tuple[str, int]]
) -> None:
    assert places_of(SOUND.replace(old, new, 1)) == expected


def test_a_file_that_starts_like_a_robot_is_answered_with_a_fleets_start() -> None:
    with pytest.raises(RejectedError) as raised:
        validate_fleet(load(SOUND.replace("fleet: 1", "tfcompose: 1"), "fleet.yaml"))
    assert any(
        finding.code == "TF101" and "fleet: 1" in finding.help for finding in raised.value.findings
    )


def test_an_empty_file_is_answered_with_a_fleets_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fleet.yaml").write_text("", "utf-8")
    assert main(["fleet", "lint", str(tmp_path / "fleet.yaml")]) == 1
    assert "fleet: 1" in capsys.readouterr().err
    robot = "tfcompose: 1\nrobot: r1\nlinks: {base_link: {}}\nfleet: fleet.yaml\n"
    (tmp_path / "robot.yaml").write_text(robot, "utf-8")
    assert main(["lint", str(tmp_path / "robot.yaml")]) == 1
    assert "fleet: 1" in capsys.readouterr().out


def test_the_command_lints_and_needs_a_robot_that_is_there(tmp_path: Path) -> None:
    (tmp_path / "fleet.yaml").write_text(SOUND, encoding="utf-8")
    for words, code in (
        (["lint"], 0),
        (["share", "r3"], 2),
        (["echo", "a"], 2),
        (["lint", "no.yaml"], 2),
    ):
        command = [sys.executable, "-m", "tfcompose", "fleet", *words]
        assert processes.run(command, cwd=tmp_path).returncode == code, words
