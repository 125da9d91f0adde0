"""Bad input: one clear finding with its place, exit 1 or 2, no traceback, nothing written."""

import errno
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.bad_input import BAD, GOOD
from tests.support.cli import tfcompose_in

ROBOTS = Path(__file__).parents[2] / "robots"


def tfcompose(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return tfcompose_in(cwd, *words)


def with_a_process(
    *words: str, cwd: Path, text: str = "", **environment: str
) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", *words]
    return processes.run(command, cwd=cwd, env=os.environ | environment, stdin=text)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder in a folder, so that what is written outside of it is seen too."""
    made = tmp_path / "in" / "here"
    made.mkdir(parents=True)
    return made


def everything_below(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("command", ["lint", "build", "tree"])
def test_a_bad_file_gives_one_finding_and_emits_nothing(
    case: str, command: str, folder: Path, tmp_path: Path
) -> None:
    data, code, (line, column), exit_code = BAD[case]
    (folder / "robot.yaml").write_bytes(data)
    before = everything_below(tmp_path)
    done = tfcompose(command, cwd=folder)
    output = done.stdout + done.stderr
    assert done.returncode == exit_code, output
    assert f"robot.yaml:{line}:{column}: error[{code}]" in output
    assert output.count("error[") == 1
    assert "Traceback" not in output
    assert len(output) < 3000
    assert everything_below(tmp_path) == before


@pytest.mark.parametrize("command", ["lint", "build", "tree"])
@pytest.mark.parametrize("kind", ["missing", "folder", "fifo", "a file as a folder", "unreadable"])
def test_what_cannot_be_read_is_one_finding_and_exit_2(
    command: str, kind: str, folder: Path, tmp_path: Path
) -> None:
    file = folder / "robot.yaml"
    words = [command, "robot.yaml"]
    if kind == "folder":
        file.mkdir()
    elif kind == "fifo":
        os.mkfifo(file)
    elif kind == "a file as a folder":
        file.write_text(GOOD)
        words = [command, "robot.yaml/robot.yaml"]
    elif kind == "unreadable":
        file.write_text(GOOD)
        file.chmod(0)
        if os.access(file, os.R_OK):
            pytest.skip("this user may read everything")
    before = everything_below(tmp_path)
    done = tfcompose(*words, cwd=folder)
    output = done.stdout + done.stderr
    assert done.returncode == 2
    assert output.count("error[TF001]") == 1
    assert "Traceback" not in output
    assert everything_below(tmp_path) == before


WRONG_USE = {
    "no command": (),
    "unknown command": ("lnit",),
    "unknown option of no command": ("--froce",),
    "unknown option": ("lint", "--froce"),
    "abbreviated option": ("lint", "--form", "json"),
    "unknown format": ("lint", "--format", "xml"),
    "too many files": ("build", "robot.yaml", "other.yaml"),
    "too few words": ("pose", "robot.yaml", "a"),
    "a NUL is no name": ("lint", ""),
}


@pytest.mark.parametrize("case", WRONG_USE)
def test_wrong_use_is_exit_2_and_says_what_there_is(
    case: str, folder: Path, tmp_path: Path
) -> None:
    (folder / "robot.yaml").write_text(GOOD)
    before = everything_below(tmp_path)
    done = tfcompose(*WRONG_USE[case], cwd=folder)
    assert done.returncode == 2
    assert done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert everything_below(tmp_path) == before


@pytest.mark.parametrize("words", [(), ("bag",), ("--with", "robot.yaml")])
@pytest.mark.parametrize(("command", "bag"), [("play", "BAG"), ("rebag", "IN")])
def test_a_missing_argument_leads_to_all_required_ones(
    command: str, bag: str, words: tuple[str, ...], folder: Path
) -> None:
    done = tfcompose(command, *words, cwd=folder)
    assert done.returncode == 2
    assert f"tfcompose {command} {bag} --with FILE|PLAN;" in done.stderr


def test_a_command_that_is_nearly_one_is_named(folder: Path) -> None:
    assert re.search(r"\blnit\b.*\blint\b", tfcompose("lnit", cwd=folder).stderr)


@pytest.mark.parametrize(
    ("words", "instead"),
    [
        ("status", "ps"),
        ("list", "ps"),
        ("new", "init"),
        ("run", "up"),
        ("launch", "up"),
        ("check", "lint"),
        ("validate", "lint"),
        ("kill", "down"),
        ("kubernetes", "export k8s"),
        ("help status", "ps"),
        ("export kubernetes", "k8s"),
        ("start rover.yaml", "up rover.yaml"),
        ("stop rover.yaml", "down"),
    ],
)
def test_a_word_that_other_programs_have_leads_to_the_command(
    words: str, instead: str, folder: Path
) -> None:
    done = tfcompose(*words.split(), cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.search(rf"\b{instead}\b", done.stderr)


OPTIONS_BETWEEN = {
    "export": "export k8s --image X robot.yaml -o built",
    "export by name": "export -o built launch robot.yaml --set robot=s",
    "explain": "explain robot.yaml -p p base_link laser",
    "pose": "pose --format json robot.yaml base_link --set robot=s laser",
    "diff": "diff robot.yaml --format json robot.yaml",
    "tree": "tree robot.yaml --format json n:=1 -p p",
}


@pytest.mark.parametrize("case", OPTIONS_BETWEEN)
def test_options_may_stand_between_the_other_words(case: str, folder: Path) -> None:
    text = (
        "args: {n: 1}\nprofiles: {p: {}}\nframes: {laser: {parent: base_link, xyz: [1, 0, 0]}}\n"
    )
    (folder / "robot.yaml").write_text(f"{GOOD}{text}")
    done = tfcompose(*OPTIONS_BETWEEN[case].split(), cwd=folder)
    assert done.returncode == 0, done.stderr


def test_a_profile_that_only_parts_have_leads_to_them(folder: Path) -> None:
    (folder / "part.yaml").write_text(f"{GOOD}profiles: {{demo: {{robot: p}}}}\n")
    parts = "parts: {r1: {spec: part.yaml, namespace: r1, prefix: r1_}, r2: {spec: none.yaml}}\n"
    (folder / "robot.yaml").write_text(f"{GOOD}{parts}")
    done = tfcompose("lint", "robot.yaml", "-p", "demo", cwd=folder)
    assert re.search(r"error\[TF009\].*\n(.*\n)*.*help: .*r1: {profiles: \[demo\]}", done.stdout)
    assert "r2" not in done.stdout


def test_an_unknown_profile_is_named_with_the_nearest_one(folder: Path) -> None:
    done = tfcompose("build", str(ROBOTS / "my_robot.yaml"), "--profile", "dmeo", cwd=folder)
    assert done.returncode == 1
    assert re.search(r"error\[TF009\] .*\bdmeo$", done.stderr, re.MULTILINE)
    assert re.search(r"help: .*\bdemo\b", done.stderr)
    assert not everything_below(folder)


def test_an_unknown_frame_is_named_with_the_nearest_one(folder: Path) -> None:
    done = tfcompose("pose", str(ROBOTS / "my_robot.yaml"), "base_link", "laser_lnik", cwd=folder)
    assert (done.returncode, done.stdout) == (1, "")
    assert re.search(r"\blaser_lnik\b.*\blaser_link\b", done.stderr)


def test_text_that_steers_a_terminal_is_shown_and_not_obeyed(folder: Path) -> None:
    (folder / "robot.yaml").write_text(GOOD + '"a\\e[2J\\nb": 1\n')
    done = tfcompose("lint", cwd=folder)
    assert "\033" not in done.stdout
    assert "unknown key a\\x1b[2J\\nb" in done.stdout


def test_output_that_the_terminal_cannot_show_is_escaped(folder: Path) -> None:
    done = with_a_process(
        "tree", str(ROBOTS / "my_robot.yaml"), cwd=folder, PYTHONIOENCODING="ascii"
    )
    assert done.returncode == 0
    assert "\\u2500" in done.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_cannot_be_saved_is_one_sentence(folder: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = processes.run(
            [sys.executable, "-m", "tfcompose", "tree", str(ROBOTS / "my_robot.yaml")],
            cwd=folder,
            stdout=full,
            stderr=subprocess.PIPE,
        )
    assert done.returncode == 2
    assert done.stderr.startswith("tfcompose: ")
    assert os.strerror(errno.ENOSPC) in done.stderr


@pytest.mark.parametrize(
    "words", [("tree", "robots/autonomous_robot.yaml"), ("--help",), ("up", "--help")]
)
def test_a_reader_that_goes_away_causes_no_traceback(words: tuple[str, ...]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as gone:
        done = processes.run(
            [sys.executable, "-m", "tfcompose", *words],
            cwd=ROBOTS.parent,
            stdout=gone,
            stderr=subprocess.PIPE,
        )
    assert (done.returncode, done.stderr) == (141, "")


def test_a_pipe_that_is_open_already_is_read(folder: Path) -> None:
    assert with_a_process("lint", "/dev/stdin", cwd=folder, text=GOOD).returncode == 0
    assert with_a_process("lint", "/dev/stdin", cwd=folder, text="robot").returncode == 1


def test_lint_in_json_is_a_list_of_findings_as_the_contract_has_them(folder: Path) -> None:
    (folder / "robot.yaml").write_text(
        GOOD + "frames: {a: {parent: base_link}}\nframes: {}\ngaurd: {}\n"
    )
    done = tfcompose("lint", "--format", "json", cwd=folder)
    assert done.returncode == 1
    findings = json.loads(done.stdout)
    assert findings == [
        {
            "code": "TF003",
            "name": "duplicate_key",
            "severity": "error",
            "message": findings[0]["message"],
            "file": "robot.yaml",
            "line": 5,
            "column": 1,
            "end_line": 5,
            "end_column": 7,
            "help": findings[0]["help"],
            "notes": [
                {
                    "message": findings[0]["notes"][0]["message"],
                    "file": "robot.yaml",
                    "line": 4,
                    "column": 1,
                }
            ],
        },
        {
            "code": "TF101",
            "name": "unknown_key",
            "severity": "error",
            "message": "unknown key gaurd",
            "file": "robot.yaml",
            "line": 6,
            "column": 1,
            "end_line": 6,
            "end_column": 6,
            "help": "did you mean guard?",
            "notes": [],
        },
    ]


def test_json_lint_is_an_empty_list_if_clean_and_a_finding_if_no_file(
    folder: Path,
) -> None:
    (folder / "robot.yaml").write_text(GOOD)
    assert json.loads(tfcompose("lint", "--format", "json", cwd=folder).stdout) == []
    done = tfcompose("lint", "--format", "json", "nothing.yaml", cwd=folder)
    assert done.returncode == 2
    assert [
        (entry["code"], entry["file"], entry["line"]) for entry in json.loads(done.stdout)
    ] == [("TF001", "nothing.yaml", 1)]


def test_a_warning_fails_lint_only_with_strict(folder: Path) -> None:
    text = (
        GOOD + "sensors: {c: {preset: realsense/d435i, parent: base_link, place: c_color_frame}}\n"
    )
    (folder / "robot.yaml").write_text(text)
    done = tfcompose("lint", cwd=folder)
    assert done.returncode == 0
    assert "warning[TF405]" in done.stdout
    assert tfcompose("lint", "--fail-on", "warning", cwd=folder).returncode == 1


def test_an_unknown_frame_on_the_floor_is_named_at_its_value(folder: Path) -> None:
    (folder / "robot.yaml").write_text(GOOD + "ground: bas_link\n")
    head = tfcompose("lint", cwd=folder).stdout.splitlines()[0]
    assert head.startswith("robot.yaml:4:9: error[TF203] ")


def test_lint_shows_the_line_and_a_caret_under_the_place(folder: Path) -> None:
    (folder / "robot.yaml").write_text(GOOD + "frames: {a: {parent: bas_link}}\n")
    head, line, caret, advice, last = tfcompose("lint", cwd=folder).stdout.splitlines()
    assert head.startswith("robot.yaml:4:22: error[TF203] ")
    assert line == "    4 | frames: {a: {parent: bas_link}}"
    assert caret == "      |                      ^^^^^^^^"
    assert advice.startswith("   help: ")
    assert "base_link" in advice
    assert last == "1 error in 1 file"


def test_lint_checks_a_file_with_each_of_its_profiles(folder: Path) -> None:
    (folder / "robot.yaml").write_text(
        GOOD + "profiles: {one: {frames: {a: {parent: b}}}, two: {}}\n"
    )
    done = tfcompose("lint", cwd=folder)
    assert done.returncode == 1
    assert "with --profile one" in done.stdout
    assert done.stdout.count("error[") == 1
    assert tfcompose("lint", "--profile", "two", cwd=folder).returncode == 0


def test_pose_in_json_is_the_pose_of_the_second_frame_in_the_first(folder: Path) -> None:
    done = tfcompose(
        "pose",
        str(ROBOTS / "my_robot.yaml"),
        "camera_link",
        "laser_link",
        "--format",
        "json",
        cwd=folder,
    )
    pose = json.loads(done.stdout)
    assert set(pose) == {"parent", "child", "xyz", "quat_xyzw", "rpy"}
    assert (pose["parent"], pose["child"]) == ("camera_link", "laser_link")
    assert pose["xyz"] == pytest.approx([-0.1, 0, 0.1])
    assert pose["quat_xyzw"] == [0, 0, 0, 1]


@pytest.mark.parametrize("closed", [">&-", "<&-", "2>&-", "<&- >&- 2>&-"])
def test_a_stream_that_is_closed_is_no_traceback(tmp_path: Path, closed: str) -> None:
    output = tmp_path / "said"
    kept = f"2>{output}" if "2>" not in closed else f">{output}" if ">&- 2" not in closed else ""
    command = f"{shlex.quote(sys.executable)} -m tfcompose explain TF301 {kept} {closed}; echo $?"
    done = processes.run(["/bin/sh", "-c", command])
    assert done.stdout.splitlines()[-1] == "0"
    assert "Traceback" not in done.stdout + done.stderr + (
        output.read_text() if output.exists() else ""
    )


@pytest.mark.parametrize("command", ["build", "export systemd"])
def test_a_folder_that_was_removed_is_named_as_the_reason(tmp_path: Path, command: str) -> None:
    (tmp_path / "robot.yaml").write_text(GOOD)
    (tmp_path / "gone").mkdir()
    words = (
        f"cd gone && rmdir ../gone && {sys.executable} -m tfcompose {command}"
        f" {tmp_path}/robot.yaml"
    )
    done = processes.run(["/bin/sh", "-c", words], cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"tfcompose: .*\bcurrent folder\b.*\n", done.stderr)


def test_arguments_of_a_xacro_file_are_given_to_lint_as_to_import(folder: Path) -> None:
    text = (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg'
        ' name)_link"/></robot>'
    )
    (folder / "r.xacro").write_text(text)
    (folder / "robot.yaml").write_text(GOOD)
    assert "error[TF106]" in tfcompose("lint", "r.xacro", cwd=folder).stdout
    assert tfcompose("lint", "r.xacro", "name:=ur5e", cwd=folder).returncode == 0
    unknown = tfcompose("lint", "r.xacro", "name:=ur5e", "nmae:=ur5e", cwd=folder)
    assert (unknown.returncode, unknown.stdout.count("error[TF106]")) == (1, 1)
    assert "error[TF016]" in tfcompose("lint", "robot.yaml", "name:=ur5e", cwd=folder).stdout
    assert tfcompose("lint", "robot.yaml", "r.xacro", "name:=ur5e", cwd=folder).returncode == 0
    assert tfcompose("lint", "r.xacro", ":=ur5e", cwd=folder).returncode == 2


def test_a_file_name_moves_no_terminals_cursor(folder: Path) -> None:
    name = "a\x1b[31m.yaml"
    (folder / name).write_text(GOOD.replace("base_link", "base link"))
    for words in (
        ["lint", name],
        ["lint", name, "--format", "github"],
        ["import", name],
        ["tree", f"{name}.yaml"],
    ):
        done = tfcompose(*words, cwd=folder)
        assert done.returncode in {1, 2}, words
        assert "\x1b" not in done.stdout + done.stderr, words


@pytest.mark.parametrize(
    "words",
    [
        "import robot.urdf",
        "import --bag b",
        "tree",
        "tree --bag b",
        "graph -o g.svg",
        "verify --bag b",
    ],
)
def test_a_duration_is_refused_where_no_running_tree_is_observed(words: str, folder: Path) -> None:
    done = tfcompose(*words.split(), "--for", "3", cwd=folder)
    assert done.returncode == 2
    assert done.stderr.startswith("tfcompose: ")
    assert "--for" in done.stderr
    assert not everything_below(folder)


@pytest.mark.parametrize(
    "words",
    [
        ("--at", "soon"),
        ("--at", "3000000000"),
        ("--at", "1.0000000001"),
        ("--precision", "-1"),
        ("--rate", "0"),
    ],
)
def test_an_option_of_echo_that_cannot_be_read_is_wrong_use(
    words: tuple[str, str], tmp_path: Path
) -> None:
    done = tfcompose("echo", "odom", "base_link", *words, cwd=tmp_path)
    assert done.returncode == 2
    assert words[1] in done.stderr
    assert "Traceback" not in done.stderr
