"""Faults injected into recorded messages, and the expectations that find them."""

from pathlib import Path

import pytest

from tests.support.bags import START_S, UP, Sent, drive, write_bag
from tests.support.cli import tfcompose_in
from tfcompose.foundation.signals import Stop
from tfcompose.tf.bags import Recording
from tfcompose.tools.treetest.case import Case
from tfcompose.tools.treetest.cases import CaseLoader
from tfcompose.tools.treetest.faults import RecordedFaults
from tfcompose.tools.treetest.running import run_case

ROBOT = """\
tfcompose: 1
robot: cart
links: {base_link: {}, arm: {}}
joints:
  arm_joint:
    {type: revolute, parent: base_link, child: arm, xyz: [0, 0, 0.5], axis: [0, 0, 1],
     limit: {lower: -90 deg, upper: 90 deg, velocity: 1 rad/s, effort: 1}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {external: true, node: drive}
  arm_joints: {simulate: {joints: zero, rate: 50 Hz}}
"""
SENT: list[Sent] = [
    ("/tf_static", 0.0, "base_link", "laser", 0.0, (0.24, 0.0, 0.3), UP),
    *drive(seconds=3.0),
    *(
        ("/tf", tick / 20, "base_link", "arm", tick / 20, (0.0, 0.0, 0.5), UP)
        for tick in range(60)
    ),
]
SENT.sort(key=lambda each: each[1])
#: Each fault, and an expectation that the clean recording meets and the faulty one does not.
RATE = "edges: {odom → base_link: {rate: [49 Hz, 51 Hz]}}"
AGE = "edges: {odom → base_link: {age: 100 ms}}"
LASER = "pose: {base_link → laser: {xyz: [0.24, 0, 0.3]}}"
FAULTS = [
    ("publish: {edge: odom → base_link, rate: 50 Hz, xyz: [5, 0, 0]}", RATE),
    ("publish: {edge: map → base_link}", "findings: []"),
    ("kill: drive", "findings: []"),
    ("stop: drive", "lookups: [{from: odom, to: base_link, at: 2 s, timeout: 0.2 s}]"),
    ("late: {edge: odom → base_link, by: 300 ms}", AGE),
    ("late: {edge: odom → base_link, by: 1 min}", "findings: []"),
    ("ahead: {edge: odom → base_link, by: 2 s}", "findings: []"),
    ("clock: odom → base_link", "findings: []"),
    ("drop: {edge: odom → base_link, share: 0.5}", "findings: []"),
    ("drop: {edge: base_link → laser}", "complete: 1 s"),
    ("jitter: {edge: odom → base_link, by: 400 ms}", AGE),
    ("rename: {frame: laser, to: lasr}", "findings: []"),
    ("jump: {edge: base_link → laser, xyz: [0, 0, 2 mm]}", LASER),
    ("jump: {edge: base_link → laser, rpy: [0, 0, 1 deg]}", "findings: []"),
    ("dynamic: {edge: base_link → laser}", "findings: []"),
    ("joint: {name: arm_joint, position: 170 deg}", "pose: {base_link → arm: {rpy: [0, 0, 0]}}"),
]
PAIR = ("/tf", "/tf_static")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cart")
    (folder / "robot.yaml").write_text(ROBOT, "utf-8")
    write_bag(folder / "bag", SENT)
    return folder


def case_of(folder: Path, injection: str, expect: str) -> Case:
    text = f"robot: robot.yaml\ncases:\n  - name: drives\n    bag: bag\n    expect: {{{expect}}}\n"
    if injection:
        text += f"    inject: {{{injection}}}\n"
    (folder / "cart.test.yaml").write_text(text, "utf-8")
    (case,) = CaseLoader(trust=False).load(str(folder / "cart.test.yaml"))
    return case


@pytest.mark.parametrize(("injection", "expect"), FAULTS)
def test_each_fault_is_found_and_the_clean_recording_passes(
    injection: str, expect: str, folder: Path
) -> None:
    assert not run_case(case_of(folder, "", expect), Stop()).findings
    findings = run_case(case_of(folder, injection, expect), Stop()).findings
    assert {each.code for each in findings} == {"TF931"}, findings


@pytest.mark.parametrize(
    ("injection", "expect"),
    [each for each in FAULTS if "laser" in each[0] and "drop" not in each[0]],
)
def test_a_fault_that_begins_later_changes_the_fixed_edges_before(
    injection: str, expect: str, folder: Path
) -> None:
    case = case_of(folder, f"{injection}, at: 1 s", expect)
    assert {each.code for each in run_case(case, Stop()).findings} == {"TF931"}


@pytest.mark.parametrize(
    ("begin", "codes"), [("2.9 s", []), ("3 s", ["TF932"]), ("9 s", ["TF932"])]
)
def test_a_fault_begins_before_the_recording_ends(
    begin: str, codes: list[str], folder: Path
) -> None:
    injection = f"late: {{edge: odom → base_link, by: 1 ms}}, at: {begin}"
    findings = run_case(case_of(folder, injection, "complete: 1 s"), Stop()).findings
    assert [each.code for each in findings] == codes
    for each in findings:
        assert each.span is not None
        assert each.span.line == 6
        text = f"    inject: {{{injection}}}"
        assert each.span.column == text.index(begin) + 1


@pytest.mark.parametrize("injection", dict.fromkeys(injection for injection, _ in FAULTS))
def test_a_fault_keeps_the_order_and_the_messages_before_it(injection: str, folder: Path) -> None:
    case = case_of(folder, f"{injection}, at: 1 s", "complete: 1 s")
    recorded = list(Recording(str(folder / "bag")).messages(PAIR))
    changed, again = (
        list(RecordedFaults(case.spec.inject, case.plan).inject(recorded)) for _ in range(2)
    )
    assert changed == again
    times = [each.received_ns for each in changed]
    assert times == sorted(times)
    begin_ns = round((START_S + 1.0) * 1e9)
    before = [each for each in recorded if each.received_ns < begin_ns]
    assert changed[: len(before)] == before


def test_half_of_the_dropped_messages_are_left_and_all_delayed_ones(folder: Path) -> None:
    recorded = list(Recording(str(folder / "bag")).messages(PAIR))
    moving = [each for each in recorded if each.rows and each.rows[0][1] == "base_link"]

    def left(injection: str) -> list[tuple[int, object]]:
        case = case_of(folder, injection, "complete: 1 s")
        return [
            (each.received_ns, each.rows)
            for each in RecordedFaults(case.spec.inject, case.plan).inject(recorded)
            if each.rows and each.rows[0][1] == "base_link"
        ]

    assert len(left("drop: {edge: odom → base_link, share: 0.5}")) == len(moving) / 2
    assert len(left("drop: {edge: odom → base_link, share: 0.2}, at: 1 s")) == 50 + 80
    delayed = left("jitter: {edge: odom → base_link, by: 50 ms}")
    assert [rows for _, rows in delayed] == [each.rows for each in moving][: len(delayed)]
    late_ns = [
        arrival_ns - each.received_ns
        for (arrival_ns, _), each in zip(delayed, moving, strict=False)
    ]
    assert min(late_ns) >= 0
    assert max(late_ns) <= 50e6
    assert len(set(late_ns)) > len(moving) / 2


@pytest.mark.parametrize(
    ("injection", "code"),
    [
        ("late: {edge: odom → base_lnk, by: 1 s}", "TF930"),
        ("clock: base_link → odom", "TF930"),
        ("dynamic: {edge: odom → base_link}", "TF930"),
        ("kill: drve", "TF930"),
        ("joint: {name: arm, position: 1 rad}", "TF930"),
        ("rename: {frame: lasr, to: laser}", "TF930"),
        ("drop: {edge: odom → base_link, share: 2}", "TF106"),
        ("publish: {edge: odom → base_link, rate: 2.1e9 Hz}", "TF106"),
        ("dynamic: {edge: base_link → laser, rate: 10001 Hz}", "TF106"),
        ("ahead: {edge: odom → base_link, by: 1000001 s}", "TF106"),
        ("at: 2 s", "TF106"),
        ("kill: drive, stop: drive", "TF107"),
    ],
)
def test_a_wrong_injection_is_refused(injection: str, code: str, folder: Path) -> None:
    text = (
        "robot: robot.yaml\ncases:\n  - name: drives\n    bag: bag\n    expect: {complete: 1 s}\n"
    )
    (folder / "cart.test.yaml").write_text(f"{text}    inject: {{{injection}}}\n", "utf-8")
    done = tfcompose_in(folder, "test")
    assert done.returncode == 2
    assert f"error[{code}]" in done.stderr, done.stderr
    assert "cart.test.yaml:6:" in done.stderr
