"""What ``lint`` takes besides files.

Codes, standard input, a diff, and files that others write meanwhile.
"""

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.waiting import TIMEOUT_S, until

ROOT = Path(__file__).parents[2]
#: TF410 at 5:27, a warning; TF503 at 6:3, a warning; TF104, which prevents a build.
WARNED = """\
tfcompose: 1
robot: r
links: {base_link: {}}
frames:
  mast: {parent: base_link, rpy: [0, 0, 90]}
  Lidar: {parent: base_link, xyz: [0, 0, 1 m]}
"""
WRONG = WARNED.replace("1 m", "1 metr")
FIXABLE = WARNED.replace("parent: base_link, xyz", "parnt: base_link, xyz")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in (("warned", WARNED), ("wrong", WRONG), ("fixable", FIXABLE)):
        (tmp_path / f"{name}.yaml").write_text(text, "utf-8")
    (tmp_path / "params.yaml").write_text("amcl: {ros__parameters: {alpha1: 0.2}}\n", "utf-8")
    return tmp_path


def codes_of(done: subprocess.CompletedProcess[str]) -> set[str]:
    return {entry["code"] for entry in json.loads(done.stdout)}


def test_select_and_ignore_leave_what_prevents_a_build(folder: Path) -> None:
    def lint(*words: str) -> set[str]:
        return codes_of(tfcompose_in(folder, "lint", "wrong.yaml", "--format", "json", *words))

    everything = lint()
    assert {"TF104", "TF410", "TF503"} <= everything
    assert lint("--select", "TF5") == {"TF104", "TF503"}
    assert lint("--ignore", "TF410", "--ignore", "TF5") == everything - {"TF410", "TF503"}
    assert lint("--select", "TF4,TF503", "--ignore", "TF41") == {"TF104", "TF503"}


@pytest.mark.parametrize("codes", ["TF104", "TF000", "", "TF410,no"])
def test_a_code_that_is_none_or_cannot_be_silenced_is_refused(codes: str, folder: Path) -> None:
    assert tfcompose_in(folder, "lint", "wrong.yaml", "--ignore", codes).returncode == 2


def test_of_more_than_ten_findings_of_one_code_the_rest_is_counted(
    folder: Path,
) -> None:
    links = "".join(f"  l{n}: {{parent: unknown{n}}}\n" for n in range(13))
    (folder / "many.yaml").write_text(
        f"tfcompose: 1\nrobot: r\nlinks:\n  base_link: {{}}\n{links}"
    )
    folded = tfcompose_in(folder, "lint", "many.yaml").stdout
    assert (folded.count("[TF203]"), folded.count("3 more TF203")) == (10, 1)
    every = tfcompose_in(folder, "lint", "--all", "many.yaml").stdout
    assert (every.count("[TF203]"), every.count("more TF203")) == (13, 0)


def test_standard_input_is_linted_with_its_lines(folder: Path) -> None:
    done = processes.run([sys.executable, "-m", "tfcompose", "lint", "-"], stdin=WRONG, cwd=folder)
    assert done.returncode == 1
    assert "-:6:42: error[TF104]" in done.stdout
    assert "    6 |   Lidar:" in done.stdout
    for option in ("--fix", "--diff", "--watch"):
        assert tfcompose_in(folder, "lint", "-", option).returncode == 2


def test_diff_prints_what_fix_would_write_and_writes_nothing(folder: Path) -> None:
    done = tfcompose_in(folder, "lint", "--diff", "fixable.yaml", "warned.yaml")
    assert (done.returncode, (folder / "fixable.yaml").read_text("utf-8")) == (1, FIXABLE)
    assert "TF410" in done.stderr
    lines = done.stdout.splitlines()
    changed = [line for line in lines if line.startswith(("-", "+"))]
    old, new = (
        next(line for line in text.splitlines() if "Lidar" in line) for text in (FIXABLE, WARNED)
    )
    assert changed == ["--- fixable.yaml", "+++ fixable.yaml", f"-{old}", f"+{new}"]
    assert tfcompose_in(folder, "lint", "--diff", "warned.yaml").returncode == 0


@pytest.mark.parametrize("option", ["--diff", "--watch"])
def test_what_is_for_people_is_not_mixed_with_what_programs_read(
    option: str, folder: Path
) -> None:
    done = tfcompose_in(folder, "lint", "fixable.yaml", option, "--format", "json")
    assert (done.returncode, done.stdout) == (2, "")


def test_junit_has_a_case_for_each_file(folder: Path) -> None:
    done = tfcompose_in(folder, "lint", "--format", "junit", "warned.yaml", "wrong.yaml")
    cases = {
        case.get("name"): case.find("failure")
        for case in ET.fromstring(done.stdout).iter("testcase")  # noqa: S314
    }
    assert cases.keys() == {"warned.yaml", "wrong.yaml"}
    assert cases["warned.yaml"] is None
    assert cases["wrong.yaml"] is not None


def test_warnings_alone_exit_0_and_the_last_line_gives_the_option(folder: Path) -> None:
    done = tfcompose_in(folder, "lint", "warned.yaml")
    assert (done.returncode, "--fail-on warning" in done.stdout) == (0, True)
    done = tfcompose_in(folder, "lint", "warned.yaml", "--fail-on", "warning")
    assert (done.returncode, "--fail-on" in done.stdout) == (1, False)


def test_the_hook_skips_the_yaml_of_others_and_no_robot(folder: Path) -> None:
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    assert "files" not in hook
    words = hook["entry"].split()[1:]
    done = tfcompose_in(folder, *words, "params.yaml", "wrong.yaml", "--format", "json")
    assert {entry["file"] for entry in json.loads(done.stdout)} == {"wrong.yaml"}
    assert tfcompose_in(folder, *words, "params.yaml").returncode == 0
    assert tfcompose_in(folder, "lint", "params.yaml").returncode == 1


def test_watch_lints_again_when_a_file_changes(folder: Path) -> None:
    command = [sys.executable, "-m", "tfcompose", "lint", "--watch", str(folder)]
    watch = processes.Started(
        processes.start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    )
    assert until(lambda: watch.output.count("watching") == 1)
    assert "TF104" in watch.output
    (folder / "wrong.yaml").write_text(WARNED, "utf-8")
    assert until(lambda: watch.output.count("watching") == 2)
    (folder / "new.yaml").write_text(WRONG.replace("robot: r", "robot: s"), "utf-8")
    assert until(lambda: "new.yaml:6:42" in watch.output)
    (folder / "units").mkdir()
    (folder / "new.yaml").write_text(WARNED + "overlays: {by: hostname, folder: units}\n", "utf-8")
    assert until(lambda: watch.output.count("watching") == 4)
    (folder / "units/ant.yaml").write_text("frames: {mast: {xyz: 1}}\n", "utf-8")
    assert until(lambda: "units/ant.yaml:1:22" in watch.output)
    watch.process.send_signal(2)
    assert watch.process.wait(TIMEOUT_S) == 130


def test_force_color_colours_a_pipe_unless_no_color_is_set(folder: Path) -> None:
    rest = {
        name: value
        for name, value in os.environ.items()
        if name not in {"FORCE_COLOR", "NO_COLOR"}
    }
    command = [sys.executable, "-m", "tfcompose", "lint", "warned.yaml"]

    def is_coloured(**environment: str) -> bool:
        return "\033[" in processes.run(command, cwd=folder, env=rest | environment).stdout

    assert is_coloured(FORCE_COLOR="1")
    assert not is_coloured(FORCE_COLOR="1", NO_COLOR="1")
    assert not is_coloured()
