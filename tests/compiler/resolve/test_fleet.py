"""The process that shares a robot's edges, where the robot says that it is one of a fleet."""

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.foundation.findings import RejectedError, finding
from tfcompose.model.robot import Process

FLEET = """
fleet: 1
share: [odom → base_link]
robots: {rover: {router: tcp/10.0.0.11:7447}, r2: {router: tcp/10.0.0.12:7447, share: [two/odom → two/base_link]}}
"""  # noqa: E501 (a text as its reader has it)
ROBOT = """
tfcompose: 1
robot: rover
fleet: fleets/fleet.yaml
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
processes:
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
"""


def compiled(text: str = ROBOT, fleet: str = FLEET) -> Compiled:
    def read(name: str) -> str:
        if name != "robots/fleets/fleet.yaml":
            raise RejectedError([finding("TF001", name, None)])
        return fleet

    return compile_robot(text, "robots/robot.yaml", library(), read=read)


def share_of(text: str = ROBOT) -> Process:
    done = compiled(text)
    assert done.robot
    assert not done.findings, done.findings
    (process,) = (process for process in done.robot.processes if process.name == "fleet_share")
    return process


def test_the_robot_is_that_of_its_name_or_of_another_and_is_restarted() -> None:
    share = share_of()
    assert share.argv[-3:] == ("share", "rover", "${file:robots/fleets/fleet.yaml}")
    assert (share.kind, share.restart, share.required, share.ready) == (
        "run",
        "on-failure",
        False,
        None,
    )
    renamed = ROBOT.replace("fleets/fleet.yaml", "{file: fleets/fleet.yaml, robot: r2}")
    below = renamed.replace("robot: rover", "robot: rover\nros: {namespace: two, isolate: both}")
    assert share_of(below).argv[-4:] == (
        "r2",
        "${file:robots/fleets/fleet.yaml}",
        "--namespace",
        "two",
    )


def test_it_waits_for_its_router_and_runs_on_its_host_or_that_of_static() -> None:
    hosts = "hosts: {brain: {}, rear: {}}\nros: {rmw: zenoh, router: tcp/10.0.0.2:7447}\nframes:"
    text = ROBOT.replace("frames:", hosts, 1).replace(
        "processes:", "processes:\n  static: {host: brain}"
    )
    text = text.replace("drive: {", "drive: {host: rear, ")
    assert (share_of(text).host, share_of(text).after) == ("brain", {"zenoh_router": "ready"})
    assert share_of(f"{text}  fleet_share: {{host: rear, output: log}}\n").host == "rear"


def test_a_process_of_its_name_takes_its_place() -> None:
    assert share_of(f"{ROBOT}  fleet_share: {{run: [share]}}\n").argv == ("share",)
    without = compiled(ROBOT.replace("fleet: fleets/fleet.yaml\n", ""))
    assert without.robot
    assert "fleet_share" not in {process.name for process in without.robot.processes}


@pytest.mark.parametrize(
    ("text", "fleet", "file", "code"),
    [
        (ROBOT.replace("fleet.yaml", "no.yaml"), FLEET, None, "TF001"),
        (ROBOT, FLEET.replace("fleet: 1", "fleet: 2"), "robots/fleets/fleet.yaml", "TF106"),
        (
            ROBOT,
            FLEET.replace("[two/odom → two", "[map → rover").replace(
                "12:7447", "12:7447, prefix: rover/"
            ),
            "robots/fleets/fleet.yaml",
            "TF880",
        ),
        (ROBOT.replace("robot: rover", "robot: r3"), FLEET, "robots/robot.yaml", "TF886"),
        (ROBOT, FLEET.replace("[odom", "[map"), "robots/robot.yaml", "TF887"),
    ],
)
def test_what_is_wrong_with_the_fleets_file_is_found(
    text: str, fleet: str, file: str | None, code: str
) -> None:
    findings = compiled(text, fleet).findings
    assert [(entry.code, entry.span and entry.span.file) for entry in findings] == [(code, file)]


@pytest.mark.parametrize(
    "edit", [("parent: odom", "parnt: odom"), ("frames:", "frames: {gps: {}}\nframes:")]
)
def test_edges_are_not_missed_in_a_robot_that_is_refused(edit: tuple[str, str]) -> None:
    result = compiled(ROBOT.replace(*edit))
    assert "TF887" not in {entry.code for entry in result.findings}
    assert result.errors
