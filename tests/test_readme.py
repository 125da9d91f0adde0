"""The README says what the code says."""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.benchmarks import results
from tests.support import processes
from tests.support.tables import for_each
from tfcompose.catalogue import CATALOGUE
from tfcompose.cli.compiling import library
from tfcompose.cli.parser import COMMANDS, parser_of, summary_of

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", *arguments]
    return processes.run(command, cwd=cwd)


@pytest.fixture
def rover(tmp_path: Path) -> Path:
    (tmp_path / "rover.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    return tmp_path


def test_its_robot_has_no_findings(rover: Path) -> None:
    done = run("lint", "rover.yaml", cwd=rover)
    assert (done.returncode, "[TF" in done.stdout) == (0, False)


def test_its_robot_gives_the_edges_and_owners_that_up_prints(rover: Path) -> None:
    done = run("tree", "rover.yaml", cwd=rover)
    owners = Counter(words[2] for words in map(str.split, _edges(done.stdout)))
    printed = re.findall(r"live  (\S+) \(\S+\): (\d+ edges|\S+ → \S+)  ", blocks("console")[0])
    assert {owner: int(edges.split()[0]) if "edges" in edges else 1 for owner, edges in printed} == owners
    assert f"tree complete: {owners.total()} edges" in README


def _edges(tree: str) -> list[str]:
    return [re.sub(r"^[│├└─ ]+", "", line) for line in tree.splitlines()[1:]]


def test_its_lint_output_is_what_lint_prints(rover: Path) -> None:
    shown = blocks("console")[1].removeprefix("$ tfcompose lint rover.yaml\n")
    broken = blocks("yaml")[0].replace("owner: base_drive", "owner: base_driv").replace("15 deg}  ", "15 degr} ", 1)
    (rover / "rover.yaml").write_text(broken, encoding="utf-8")
    printed = run("lint", "rover.yaml", cwd=rover).stdout
    assert [line.rstrip() for line in printed.splitlines()] == [line.rstrip() for line in shown.splitlines()]


def test_its_calibrated_robot_is_linted_and_explained_as_printed(tmp_path: Path) -> None:
    section = README.partition("## Calibration files\n")[2].partition("\n## ")[0]
    robot, measured = re.findall(r"^```yaml\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    (tmp_path / "cell.yaml").write_text(robot, encoding="utf-8")
    (tmp_path / "camera.calib").write_text(measured, encoding="utf-8")
    done = run("lint", "cell.yaml", "--fail-on", "warning", cwd=tmp_path)
    assert (done.returncode, "[TF" in done.stdout) == (0, False)
    command, _, printed = re.findall(r"^```console\n(.*?)^```", section, re.MULTILINE | re.DOTALL)[0].partition("\n")
    assert run(*command.removeprefix("$ tfcompose ").split(), cwd=tmp_path).stdout == printed


def test_its_table_of_commands_is_that_of_the_command_line() -> None:
    rows = dict(re.findall(r"^\| `tfcompose (\w+)` \| (.*) \|$", README, re.MULTILINE))
    assert rows == {name: summary_of(name) for name in COMMANDS}


@for_each(COMMANDS)
def test_each_command_says_what_it_does_and_what_its_arguments_are(command: str) -> None:
    parser = parser_of(command)
    assert parser.description
    assert parser.description.strip().endswith(".")
    for action in parser._actions:
        assert action.help, f"{command} {action.dest} has no help"


def test_its_codes_are_known() -> None:
    assert set(re.findall(r"TF\d{3}", README)) <= set(CATALOGUE)


def test_its_presets_are_those_that_come_with_it() -> None:
    names = library().names
    vendors = re.search(r"^Vendors: ([^.]*)\.$", README, re.MULTILINE)
    assert vendors
    assert re.findall(r"`([^`]+)`", vendors[1]) == sorted({name.partition("/")[0] for name in names})
    shown = re.search(r"^A sensor's preset is (.*)$", README, re.MULTILINE)
    assert shown
    assert set(re.findall(r"`([a-z0-9]+/[a-z0-9-]+)`", shown[1])) <= set(names)


def test_it_has_exactly_the_two_commands_that_ci_takes_out_of_it() -> None:
    commands = re.findall(r"^python3 -m venv .*&&.*$", README, re.MULTILINE)
    assert len(commands) == 2
    assert commands[0].endswith("tfcompose up robots/autonomous_robot.yaml --profile demo")
    assert commands[1].endswith("pytest")


def test_its_figures_are_those_that_benchmarks_wrote() -> None:
    assert results.rewritten(README) == README, "python -m tests.benchmarks.results --write"


def test_every_file_of_figures_is_printed_and_says_where_it_is_from() -> None:
    files = {file.stem for file in results.FOLDER.glob("*.json")}
    assert files == results.named(README)
    for name in files:
        found = results.recorded(name)
        assert (ROOT / "tests" / "benchmarks" / f"bench_{name}.py").is_file()
        assert found["command"] == f"python -m tests.benchmarks.bench_{name} --record"
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", found["date"])
        assert found["load"] >= 0
        assert {"processor", "cores", "memory_gb", "system", "python"} == found["machine"].keys()


#: Measures of time, memory and processors, as prose and tables write them; what an example prints stands in blocks.
FIGURE = r"\d[\d,.]* (?:µs|ms|MB)\b|\d % of a core|\d times as (?:long|fast)|\d times faster"
#: Figures that are settings or limits of the program, and no measurements.
SET = {"8 MB", "1 MB", "100 ms"}


def test_no_other_figure_is_printed() -> None:
    prose = re.sub(r"^```.*?^```", "", README, flags=re.MULTILINE | re.DOTALL)
    recorded = "".join(str(results.recorded(name)["rows"]) for name in results.named(README))
    assert [figure for figure in re.findall(FIGURE, prose) if figure not in SET and figure not in recorded] == []


def test_its_python_programs_run_and_give_what_they_say() -> None:
    section = README.partition("## The buffer in Python\n")[2].partition("\n## ")[0]
    imports, program = re.findall(r"^```python\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    after = "print(round(pose.xyz[0], 9), stamp_ns, xyz.shape, quat_xyzw.shape, round(points[0, 0], 9))"
    done = processes.run([sys.executable, "-c", imports + program + after], check=True)
    assert done.stdout == "4.7 9000000000 (80, 3) (80, 4) 3.7\n"
