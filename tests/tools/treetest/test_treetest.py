"""``tfcompose test`` on recordings that the library rosbags writes."""

import json
import os
import shutil
from collections.abc import Callable, Iterable
from math import nan
from pathlib import Path
from subprocess import CompletedProcess
from xml.etree import ElementTree as ET

import pytest
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability
from rosbags.rosbag2 import Reader

from tests.support.bags import UP, Sent, drive, tfcompose_without_ros, write_bag
from tests.support.cli import tfcompose_in
from tfcompose.tf.bags import Recording
from tfcompose.tools.treetest.running import name_of_folder

ROBOT = """\
tfcompose: 1
robot: cart
frames:
  odom: {}
  base_link: {parent: odom, owner: drive}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3], rpy: [0, 0, 90 deg]}
processes:
  drive: {external: true, node: drive}
profiles:
  high: {frames: {laser: {xyz: [0.24, 0, 0.4]}}}
"""
#: A quarter turn about z.
LEFT = (0.0, 0.0, 0.5**0.5, 0.5**0.5)
LASER: Sent = ("/tf_static", 0.0, "base_link", "laser", 0.0, (0.24, 0.0, 0.3), LEFT)
DRIVE = [LASER, *drive()]

Judge = Callable[..., CompletedProcess[str]]


@pytest.fixture
def judge(tmp_path: Path) -> Judge:
    """Return a function that judges one case's expectations, the text below ``expect:``."""

    def run(
        expect: str, sent: Iterable[Sent] = DRIVE, *words: str, more: str = ""
    ) -> CompletedProcess[str]:
        (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
        shutil.rmtree(tmp_path / "bag", ignore_errors=True)
        write_bag(tmp_path / "bag", sent)
        text = f"robot: robot.yaml\ncases:\n  - name: drives\n    bag: bag\n{more}    expect:\n"
        lines = "".join(f"      {line}\n" for line in expect.splitlines())
        (tmp_path / "cart.test.yaml").write_text(text + lines, "utf-8")
        return tfcompose_in(tmp_path, "test", *words)

    return run


def failures(done: CompletedProcess[str]) -> list[str]:
    """Return the line, the column and the code of each finding."""
    heads = [
        line.split(" ", 2)
        for line in (done.stdout + done.stderr).splitlines()
        if line.startswith("cart.test.yaml:")
    ]
    return [f"{place.split(':', 1)[1]} {severity}" for place, severity, _ in heads]


def later(sent: Iterable[Sent], seconds: float) -> list[Sent]:
    return [(topic, at_s + seconds, *rest) for topic, at_s, *rest in sent]  # type: ignore[misc]


def moved(sent: Iterable[Sent], from_s: float, xyz: tuple[float, float, float]) -> list[Sent]:
    """Give the laser another pose from a time on."""
    return [*sent, ("/tf_static", from_s, "base_link", "laser", from_s, xyz, LEFT)]


def thinned(sent: list[Sent]) -> list[Sent]:
    """Drop every second transform."""
    return [LASER, *(row for index, row in enumerate(sent[1:]) if index % 2)]


def gap(sent: list[Sent], begin_s: float, end_s: float) -> list[Sent]:
    return [row for row in sent if not begin_s < row[1] < end_s]


RATE = "edges: {odom → base_link: {rate: [45 Hz, 55 Hz]}}"
AGE = "edges:\n  odom -> base_link: {age: 50 ms}"
POSE = "pose: {base_link → laser: {xyz: [0.24, 0, 0.3], rpy: [0, 0, 90 deg], within: 1 mm}}"
LOOKUPS = "lookups:\n  - {from: odom, to: laser, at: [1 s, 2 s, 3 s]}"
REJECTED: list[Sent] = [(*row[:5], (nan, 0.0, 0.0), UP) for row in drive()]
SECOND: list[Sent] = [("/tf", 1.0, "map", "base_link", 1.0, (0.0, 0.0, 0.0), UP)]


@pytest.mark.parametrize(
    "expect",
    [
        "complete: 100 ms",
        RATE,
        AGE,
        "edges: {odom → base_link: {owner: drive}}",
        POSE,
        "pose: {laser → base_link: {xyz: [0, 0.24, -0.3]}}",
        "pose: {base_link → laser: {look: left}}",
        LOOKUPS,
        "findings: []",
    ],
)
def test_a_met_expectation_passes(expect: str, judge: Judge) -> None:
    done = judge(expect)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines() == ["passed  cart.test.yaml: drives", "1 case, 0 failed"]


@pytest.mark.parametrize(
    ("expect", "sent", "place", "texts"),
    [
        ("complete: 100 ms", [LASER, *later(drive(), 0.2)], "6:17", ["0.204 s"]),
        ("complete: 100 ms", drive(), "6:17", ["base_link → laser"]),
        ("complete: 1 s", [LASER, *REJECTED], "6:17", ["tf2 rejects"]),
        (RATE, thinned(DRIVE), "6:40", ["25 Hz"]),
        (RATE, gap(DRIVE, 1.0, 2.5), "6:40", ["2.504 s"]),
        (RATE, [LASER], "6:15", ["odom → base_link"]),
        (RATE, [LASER, *REJECTED], "6:15", ["odom → base_link"]),
        (RATE, DRIVE[:2], "6:40", ["1 message"]),
        ("edges:\n  odom → base_link: {rate: [10 Hz, 20 Hz]}", DRIVE, "7:34", ["50 Hz"]),
        (AGE, [LASER, *drive(late_s=0.08)], "7:34", ["80 ms"]),
        ("edges:\n  odom → base_link: {owner: static}", DRIVE, "7:35", ["drive", "static"]),
        (POSE, moved(drive(), 0.0, (0.24, 0.0, 0.302)), "6:14", ["2 mm"]),
        (POSE, moved(DRIVE, 2.0, (0.24, 0.0, 0.34)), "6:14", ["40 mm", "2.000 s"]),
        ("pose: {base_link → laser: {look: right}}", DRIVE, "6:14", ["180 deg"]),
        (POSE, drive(), "6:14", ["laser"]),
        (LOOKUPS, drive(), "7:40", ["laser"]),
        (LOOKUPS, gap(DRIVE, 0.9, 2.5), "7:40", []),
        ("lookups:\n  - {from: odom, to: laser, at: 5 s}", DRIVE, "7:39", ["ends before"]),
        ("findings: []", [*DRIVE, *SECOND], "6:7", ["TF"]),
        ("findings:\n  - {code: TF803}", DRIVE, "7:11", ["TF803"]),
    ],
)
def test_a_failed_expectation_is_reported_at_its_line(
    expect: str, sent: list[Sent], place: str, texts: list[str], judge: Judge
) -> None:
    done = judge(expect, sent)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"{place}: error[TF931]" in failures(done), done.stdout
    for text in texts:
        assert text in done.stdout
    assert done.stdout.splitlines()[-1] == "1 case, 1 failed"


def test_lint_reports_what_test_would_before_it_runs_a_case(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    suite = tmp_path / "cart.test.yaml"
    expect = "{edges: {odom → bas_link: {owner: drive}}, complete: soon}"
    suite.write_text(f"robot: robot.yaml\ncases:\n  - name: x\n    expect: {expect}\n", "utf-8")
    for words in (["cart.test.yaml"], ["."], ["--untrusted", "cart.test.yaml"]):
        assert failures(tfcompose_in(tmp_path, "lint", *words)) == ["4:66: error[TF103]"]
    suite.write_text(suite.read_text("utf-8").replace("soon", "3 s"), "utf-8")
    for words in (["cart.test.yaml"], ["--skip-foreign", "cart.test.yaml", "robot.yaml"]):
        done = tfcompose_in(tmp_path, "lint", *words)
        assert failures(done) == ["4:22: error[TF930]"]
        assert done.returncode == 1
    done = tfcompose_in(tmp_path, "lint", "--untrusted", "cart.test.yaml")
    assert done.returncode == 0, done.stdout  # it reads no other file


@pytest.mark.parametrize(("timeout", "late"), [("1 s", ["1"]), ("0.1 s", ["1", "2"])])
def test_a_lookup_waits_for_its_timeout(timeout: str, late: list[str], judge: Judge) -> None:
    """The transforms for 1 s and 2 s come at 2.5 s."""
    times = "at: [0.5 s, 1 s, 2 s, 3 s]"
    lookup = f"lookups:\n  - {{from: odom, to: laser, timeout: {timeout}, {times}}}"
    done = judge(lookup, gap(DRIVE, 0.9, 2.5))
    heads = [line for line in done.stdout.splitlines() if "error[TF931]" in line]
    assert [head.split(" at ", 1)[1].split(" s", 1)[0] for head in heads] == late


@pytest.mark.parametrize(
    ("laser_s", "times", "late"),
    [
        (0.5, "[0.1 s, 1 s, 2 s]", []),
        (1.8, "[0.5 s, 1 s, 2 s]", ["0.5"]),
        (0.5, "[1 s, 9 s]", ["9"]),
    ],
)
def test_a_lookup_through_fixed_edges_needs_no_message_at_its_time(
    laser_s: float, times: str, late: list[str], judge: Judge
) -> None:
    """The last message comes at 3 s."""
    lamp: Sent = ("/tf_static", 0.0, "base_link", "lamp", 0.0, (0.0, 0.0, 0.0), UP)
    sent = [lamp, *later([LASER], laser_s), *later([lamp], 3.0)]
    done = judge(f"lookups:\n  - {{from: base_link, to: laser, at: {times}}}", sent)
    assert done.returncode == bool(late), done.stdout + done.stderr
    heads = [line for line in done.stdout.splitlines() if "error[TF931]" in line]
    assert [head.split(" at ", 1)[1].split(" s", 1)[0] for head in heads] == late


def test_findings_match_by_code_and_by_names_in_full(judge: Judge) -> None:
    sent = [*DRIVE, ("/tf", 1.0, "base_link", "arm", 1.0, (0.0, 0.0, 0.0), UP)]
    done = judge("findings:\n  - {code: undeclared_edge, names: arm}", sent)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("names", ["ar", "laser"])
def test_a_finding_about_another_name_is_missing_and_unexpected(names: str, judge: Judge) -> None:
    sent = [*DRIVE, ("/tf", 1.0, "base_link", "arm", 1.0, (0.0, 0.0, 0.0), UP)]
    done = judge(f"findings:\n  - {{code: TF803, names: {names}}}", sent)
    assert failures(done) == ["7:11: error[TF931]", "6:7: error[TF931]"]


def test_a_case_has_the_profile_with_which_the_robot_ran(judge: Judge) -> None:
    sent = moved(drive(), 0.0, (0.24, 0.0, 0.4))
    done = judge("findings: []", sent, more="    profile: high\n")
    assert done.returncode == 0, done.stdout + done.stderr
    (done_text,) = [line for line in done.stdout.splitlines() if "drives" in line]
    assert done_text.startswith("passed")


@pytest.mark.parametrize(
    ("expect", "expected", "text"),
    [
        ("compete: 3 s", "6:7: error[TF101]", "complete"),
        ("complete: 3 Hz", "6:17: error[TF104]", "time"),
        ("edges: {odom: {}}", "6:15: error[TF106]", "parent → child"),
        ("edges: {odom → base_lnk: {}}", "6:15: error[TF930]", "base_link"),
        ("edges: {base_link → odom: {}}", "6:15: error[TF930]", "odom → base_link"),
        ("edges:\n  odom → base_link: {owner: drve}", "7:35: error[TF930]", "drive"),
        (
            "edges:\n  odom → base_link: {rate: [55 Hz, 45 Hz]}",
            "7:34: error[TF106]",
            "swap",
        ),
        ("pose: {base_link → lasr: {xyz: [0, 0, 0]}}", "6:14: error[TF930]", "laser"),
        ("pose: {base_link → laser: {}}", "6:33: error[TF106]", "xyz"),
        ("lookups:\n  - {from: odm, to: laser, at: 1 s}", "7:18: error[TF930]", "odom"),
        ("findings:\n  - {code: TF8031}", "7:18: error[TF106]", "TF803"),
        ("{}", "6:7: error[TF106]", "findings:"),
        ("edges: {}", "6:7: error[TF106]", "findings:"),
        ("pose: {}\nlookups: []", "6:7: error[TF106]", "findings:"),
        ("lookups:\n  - {from: odom, to: laser, at: []}", "7:39: error[TF106]", "1 s"),
        ("like: bag\nwithin: [1 mm, -1 deg]", "7:15: error[TF106]", "0.1 deg"),
        ("like: bag\nwithin: -1 mm", "7:15: error[TF106]", "30 cm"),
    ],
)
def test_a_wrong_test_file_is_refused_with_a_way_out(
    expect: str, expected: str, text: str, judge: Judge
) -> None:
    done = judge(expect)
    assert done.returncode == 2
    assert failures(done) == [expected], done.stderr
    assert text in done.stderr
    assert not done.stdout


def test_an_empty_file_is_answered_with_a_test_files_start(tmp_path: Path) -> None:
    (tmp_path / "a.test.yaml").write_text("", "utf-8")
    done = tfcompose_in(tmp_path, "test", ".")
    assert done.returncode == 2
    assert "1:1: error[TF002]" in done.stderr
    assert "cases:" in done.stderr


@pytest.mark.parametrize(
    ("name", "data", "expected"),
    [
        ("robot.yaml", None, "TF001"),
        ("robot.yaml", "tfcompose: 1\nrobot: cart\nlnks: {}\n", "TF101"),
        ("bag/metadata.yaml", "{}", "TF907"),
    ],
)
def test_no_case_runs_if_a_robot_or_a_recording_is_wrong(
    name: str, data: str | None, expected: str, judge: Judge, tmp_path: Path
) -> None:
    judge("findings: []")
    (tmp_path / name).unlink()
    if data is not None:
        (tmp_path / name).write_text(data, "utf-8")
    done = tfcompose_in(tmp_path, "test", ".")
    assert done.returncode == 2
    assert f"[{expected}]" in done.stderr
    assert not done.stdout


def test_a_folder_without_test_files_and_a_k_without_cases_exit_with_2(
    judge: Judge, tmp_path: Path
) -> None:
    assert tfcompose_in(tmp_path, "test").returncode == 2
    assert judge("findings: []", DRIVE, "-k", "park").returncode == 2
    done = tfcompose_in(tmp_path, "test", "-k", "DRIV", "cart.test.yaml", "./cart.test.yaml", ".")
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "1 case, 0 failed")
    assert tfcompose_in(tmp_path, "test", "none.test.yaml").returncode == 2
    done = tfcompose_in(tmp_path, "test", "-j", "0")
    assert (done.returncode, done.stderr.count("Traceback")) == (2, 0)


def test_reports_for_ci_have_each_case_and_the_line_of_the_expectation(
    judge: Judge, tmp_path: Path
) -> None:
    done = judge(RATE, thinned(DRIVE), "--format", "github", "--junit", "out.xml")
    assert done.returncode == 1
    (line,) = done.stdout.splitlines()
    assert line.startswith("::error file=cart.test.yaml,line=6,col=40,")
    case = ET.parse(tmp_path / "out.xml").getroot().find(".//testcase")  # noqa: S314
    assert case is not None
    assert case.get("name") == "drives"
    failure = case.find("failure")
    assert failure is not None
    assert failure.get("type") == "TF931"
    (row,) = json.loads(tfcompose_in(tmp_path, "test", "--format", "json").stdout)
    assert (row["name"], row["line"], row["passed"]) == ("drives", 3, False)
    assert [finding["line"] for finding in row["findings"]] == [6]


def test_a_failed_case_leaves_a_bag_and_a_picture_of_its_tree(
    judge: Judge, tmp_path: Path
) -> None:
    judge(RATE, DRIVE, "--keep", "kept")
    assert not list((tmp_path / "kept").iterdir())
    judge(RATE, thinned(DRIVE), "--keep", "kept")
    (folder,) = (tmp_path / "kept").iterdir()
    assert "25.0 Hz" in (folder / "tree.svg").read_text("utf-8")
    pair = ("/tf", "/tf_static")
    kept, replayed = (
        [
            (message.received_ns, message.static, message.rows)
            for message in Recording(str(bag)).messages(pair)
        ]
        for bag in (folder / "tf", tmp_path / "bag")
    )
    assert kept == replayed
    with Reader(folder / "tf") as reader:
        extras = {connection.topic: connection.ext for connection in reader.connections}
    profiles = {
        topic: extra.offered_qos_profiles
        for topic, extra in extras.items()
        if isinstance(extra, ConnectionExtRosbag2)
    }
    assert [profiles[topic][0].durability for topic in pair] == [
        QosDurability.VOLATILE,
        QosDurability.TRANSIENT_LOCAL,
    ]


def test_the_folder_of_a_case_is_of_this_case_alone() -> None:
    cases = [("a.test.yaml", "a b"), ("a.test.yaml", "a-b"), ("b/a.test.yaml", "a b")]
    cases += [("a.test.yaml", "\U00020000" * 260), ("a.test.yaml", "\U00020000" * 261)]
    names = {name_of_folder(file, name) for file, name in cases}
    assert len(names) == len(cases)
    assert "a_test_a_b" not in names
    assert max(len(os.fsencode(name)) for name in names) < 255


def test_cases_in_parallel_are_printed_in_order(judge: Judge, tmp_path: Path) -> None:
    judge("findings: []")
    text = (tmp_path / "cart.test.yaml").read_text("utf-8")
    case = text.split("cases:\n")[1]
    names = [f"drives {number}" for number in range(5)]
    cases = "".join(case.replace("drives", name) for name in names)
    (tmp_path / "cart.test.yaml").write_text(f"robot: robot.yaml\ncases:\n{cases}", "utf-8")
    done = tfcompose_in(tmp_path, "test", "-j", "3")
    passed = [line.split(": ")[1] for line in done.stdout.splitlines()[:-1]]
    assert passed == names


def test_keys_of_a_started_robot_are_refused_with_a_bag(judge: Judge) -> None:
    assert failures(judge("complete: 3 s", more="    for: 3 s\n")) == ["5:10: error[TF106]"]
    within = judge("findings: [{code: TF801, within: 3 s}]")
    assert failures(within) == ["6:40: error[TF106]"]


def test_cases_on_bags_need_no_ros_and_others_say_so(judge: Judge, tmp_path: Path) -> None:
    judge("findings: []")
    done = tfcompose_without_ros("test", str(tmp_path))
    assert done.stdout.splitlines()[-1] == "1 case, 0 failed"
    file = tmp_path / "cart.test.yaml"
    file.write_text(file.read_text("utf-8").replace("    bag: bag\n", ""), "utf-8")
    done = tfcompose_without_ros("test", str(tmp_path), code=1)
    assert f"{file}:3:11: error[TF901]" in done.stdout
