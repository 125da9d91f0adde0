"""A tool from outside of this repository can do what a tool inside does.

One that is broken stops nothing.
"""

from __future__ import annotations

import json
import os
import re
import sys
from functools import partial
from typing import TYPE_CHECKING

import pytest

from tests.support import processes
from tests.support.core import ACME, install, write_tool
from tests.support.core import run_with as run_process
from tests.support.preloaded import preloaded

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterator
    from pathlib import Path

    Run = Callable[..., subprocess.CompletedProcess[str]]

#: One worker installs the package, for all tests.
pytestmark = pytest.mark.xdist_group("acme")
ROBOT = """\
tfcompose: 1
robot: r
frames:
  base_link: {}
  mast: {parent: base_link, xyz: [0, 0, 1]}
"""
TOOL = "from tfcompose.foundation.tool import Command, Key, Tool\nTOOL = Tool("


@pytest.fixture(scope="module")
def acme(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which the package is installed."""
    return install(ACME, tmp_path_factory.mktemp("acme"))


@pytest.fixture(scope="module")
def run_with() -> Iterator[Run]:
    """Run tfcompose with these folders on Python's path, in a folder."""
    with preloaded() as forks:
        yield forks.run


@pytest.fixture
def run(run_with: Run, acme: Path, tmp_path: Path) -> Run:
    """Run tfcompose with the installed package, in a folder with a robot that has its section."""
    write_robot(tmp_path, "acme: {frame: mast, reach: 2 m}")
    return partial(run_with, acme, tmp_path)


def write_robot(folder: Path, *lines: str) -> None:
    (folder / "robot.yaml").write_text(ROBOT + "".join(f"{line}\n" for line in lines))


def completions(path: Path, folder: Path, line: str) -> set[str]:
    """Return what a shell is offered whose cursor is at the end of the line."""
    answer = folder / "completions"
    variables = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    run_process(path, folder, **variables)
    return set(answer.read_text("utf-8").split("\n"))


def findings(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Return the findings that were printed: place and code."""
    places = re.findall(
        r"^(?:(\S+:\d+:\d+): )?(?:error|warning)\[(\w+)\]", done.stdout + done.stderr, re.MULTILINE
    )
    return [f"{place} {code}".strip() for place, code in places]


def test_its_command_runs_and_stands_in_the_help(run: Run, acme: Path, tmp_path: Path) -> None:
    done = run("acme", "robot.yaml")
    assert (done.returncode, done.stdout, done.stderr) == (0, "mast\n", "")
    text = run("--help").stdout
    assert "\nTools:\n  acme        List the frames that hear a robot's beeper\n" in text
    assert "acme" in text.partition("topics,")[2]
    options = run("acme", "--help").stdout
    page = run("help", "acme").stdout
    assert "those that the section acme of FILE names" in options
    assert page.startswith(options)
    assert "# Beepers" in page
    assert completions(acme, tmp_path, "tfcompose acm") == {"acme"}


def test_its_command_topic_code_and_key_have_pages(run: Run, tmp_path: Path) -> None:
    assert run("help", "--html", "docs").returncode == 0
    for path in ("commands/acme.html", "topics/acme.html", "codes/ACME101.html"):
        assert "Beeper" in (tmp_path / "docs" / path).read_text("utf-8") or "codes" in path
    assert "of the tool acme" in (tmp_path / "docs/codes/ACME101.html").read_text("utf-8")
    assert 'id="robot.acme"' in (tmp_path / "docs/keys/robot.html").read_text("utf-8")


def test_its_section_is_validated_at_its_places(run: Run, tmp_path: Path) -> None:
    assert run("lint").returncode == 0
    write_robot(tmp_path, "acme: {frame: mast, reech: 2 m}")
    done = run("lint")
    assert findings(done) == ["robot.yaml:6:21 TF101"]
    assert "did you mean reach?" in done.stdout
    write_robot(tmp_path, "acme: {frame: mast, reach: 2 deg}")
    assert findings(run("lint")) == ["robot.yaml:6:28 TF104"]
    write_robot(tmp_path, "acne: {frame: mast}")
    assert "did you mean acme?" in run("lint").stdout


def test_its_section_is_merged_like_every_other_and_adds_its_process(
    run: Run, tmp_path: Path
) -> None:
    write_robot(
        tmp_path,
        "acme: {frame: mast}",
        "profiles: {loud: {acme: {reach: 3 m}}}",
        "processes: {beeper: {env: {LOUD: very}}}",
    )
    assert run("build", "-p", "loud", "-o", "built").returncode == 0
    plan = json.loads((tmp_path / "built/plan.json").read_text())
    (beeper,) = (process for process in plan["processes"] if process["name"] == "beeper")
    assert (beeper["argv"], beeper["env"]) == (
        ["${tfcompose}", "beep", "${plan}"],
        {"LOUD": "very"},
    )
    assert plan["sections"] == {"acme": {"frame": "mast", "reach": 3}}


#: Prints what keeps the plan's processes from being started, without starting one.
PREFLIGHT = """
import json, os
from pathlib import Path
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.plan.file import read_plan
file = Path("built/plan.json")
plan = read_plan(file.read_text(), str(file))
environment = lambda base, ros, is_built_in: dict(base)
_, found = commands_of(plan, plan.managed, file, os.environ, environment)
print(json.dumps([f"{one.code}: {one.message}" for one in found]))
"""


def hindrances(run_with: Run, path: str | Path, folder: Path, **environment: str) -> list[str]:
    assert run_with(path, folder, "build", "-o", "built").returncode == 0
    env = os.environ | {"PYTHONPATH": str(path)} | environment
    done = processes.run([sys.executable, "-c", PREFLIGHT], cwd=folder, env=env, check=True)
    messages: list[str] = json.loads(done.stdout)
    return messages


def test_its_process_reads_its_section_of_the_plan(
    run: Run, run_with: Run, acme: Path, tmp_path: Path
) -> None:
    assert hindrances(run_with, acme, tmp_path) == []
    done = run("beep", "built/plan.json")
    assert (done.returncode, done.stdout) == (0, "beep on mast, heard 2 m away\n")


def test_its_preflight_check_runs_before_anything_starts(
    run_with: Run, acme: Path, tmp_path: Path
) -> None:
    write_robot(tmp_path, "acme: {frame: mast}")
    assert hindrances(run_with, acme, tmp_path, ACME_MUTED="1") == [
        "ACME103: mast is muted by ACME_MUTED"
    ]


def test_a_preflight_check_that_crashes_is_a_bug_of_the_tool(
    run_with: Run, tmp_path: Path
) -> None:
    key = "Key('bell', 'bell:Bell', 'a bell', in_plan=True)"
    spec = "from tfcompose.spec.language.spec import Spec\nclass Bell(Spec): pass"
    more = f"preflight='bell:no_such_function', keys=({key},)"
    write_tool(tmp_path / "site", "bell", f"{spec}\n{TOOL}name='bell', package='bell', {more})")
    write_robot(tmp_path, "bell: {}")
    (message,) = hindrances(run_with, tmp_path / "site", tmp_path)
    assert re.match("TF903: bell:no_such_function of bell crashed: AttributeError", message)


def test_its_rule_finds_at_its_place_and_can_be_silenced_and_explained(
    run: Run, tmp_path: Path
) -> None:
    write_robot(tmp_path, "acme: {frame: nowhere}")
    assert findings(run("lint")) == ["robot.yaml:6:15 ACME101"]
    assert findings(run("lint", "--select", "TF2")) == []
    write_robot(tmp_path, "acme: {frame: nowhere} # tfcompose: allow ACME101 because of a test")
    assert findings(run("lint")) == []
    write_robot(tmp_path, "acme: {frame: nowhere}", "rules: {ACME101: off}")
    assert findings(run("lint")) == []
    explained = run("explain", "ACME101").stdout
    assert explained.startswith("ACME101 beeper_on_nothing\n\nThe beeper is on a frame")
    assert run("explain", "beeper_on_nothing").stdout == explained


def test_its_names_are_in_the_schema_and_the_reference(run: Run) -> None:
    schema = json.loads(run("schema").stdout)
    assert schema["properties"]["acme"]["description"] == "the robot's beeper"
    assert schema["$defs"]["AcmeSpec"]["properties"].keys() == {"frame", "reach"}
    assert "ACME101" in schema["properties"]["rules"]["properties"]
    assert "how far it is heard" in run("help", "acme.reach").stdout
    assert "| ACME101 | beeper_on_nothing | error |" in run("help", "codes").stdout


def test_its_check_finds_at_its_place(run: Run, tmp_path: Path) -> None:
    write_robot(tmp_path, "acme: {frame: mast, reach: 1 km}")
    assert findings(run("lint")) == ["robot.yaml:6:28 ACME102"]


def test_its_option_runs_another_command_its_way(run: Run, acme: Path, tmp_path: Path) -> None:
    assert run("tree", "--beeper").stdout == "tree: mast\n"
    assert "base_link" in run("tree").stdout
    assert "--beeper" in run("tree", "--help").stdout
    assert completions(acme, tmp_path, "tfcompose tree --bee") == {"--beeper"}


def test_its_own_kind_of_file_has_a_schema_and_a_reference(run: Run) -> None:
    assert "beepers" in json.loads(run("schema", "beepers").stdout)["properties"]
    reference = run("schema", "beepers", "--reference").stdout
    assert reference.startswith("# The language of beepers, version 1\n")


def test_its_preset_is_found(run: Run, tmp_path: Path) -> None:
    write_robot(tmp_path, "sensors: {b: {preset: acme/beeper-1, parent: mast, driver: none}}")
    assert "TF601" not in run("lint").stdout
    assert "acme/beeper-1" in run("presets", "acme").stdout


@pytest.mark.parametrize(
    "module",
    ["import no_such_module", "TOOL = 1", "raise SystemError('no')"],
    ids=["import", "type", "crash"],
)
def test_a_tool_that_does_not_load_is_one_finding_and_the_rest_goes_on(
    run_with: Run, module: str, acme: Path, tmp_path: Path
) -> None:
    write_tool(tmp_path / "broken", "broken", module)
    path = f"{acme}:{tmp_path / 'broken'}"
    write_robot(tmp_path, "acme: {frame: mast}")
    done = run_with(path, tmp_path, "--help")
    assert (done.returncode, findings(done)) == (0, ["TF921"])
    assert "the tool broken" in done.stderr
    assert "  acme " in done.stdout
    assert run_with(path, tmp_path, "acme").stdout == "mast\n"
    done = run_with(path, tmp_path, "lint")
    assert (done.returncode, findings(done)) == (0, ["TF921"])
    write_robot(tmp_path)
    assert findings(run_with(path, tmp_path, "lint")) == []


@pytest.mark.parametrize(
    "brings",
    [
        "commands=(Command('lint', 's', 'x'),)",
        "commands=(Command('view', 's', 'x'),)",
        "commands=(Command('acme', 's', 'x'),)",
        "keys=(Key('frames', 'x:X', 'about'),)",
        "keys=(Key('fleet', 'x:X', 'about'),)",
        "keys=(Key('acme', 'x:X', 'about'),)",
    ],
)
def test_a_clash_of_commands_or_keys_is_a_finding_and_the_first_one_stays(
    run_with: Run, brings: str, acme: Path, tmp_path: Path
) -> None:
    write_tool(tmp_path / "second", "second", f"{TOOL}name='second', package='second', {brings})")
    path = f"{acme}:{tmp_path / 'second'}"
    write_robot(tmp_path, "acme: {frame: mast}")
    done = run_with(path, tmp_path, "--help")
    assert findings(done) == ["TF922"]
    kind, name = ("key" if "Key" in brings else "command"), brings.split("'")[1]
    assert f"has the {kind} {name}" in done.stderr
    assert run_with(path, tmp_path, "acme").stdout == "mast\n"


@pytest.mark.parametrize("code", ["ACME101", "TF801", "TF999", "acme1"])
def test_a_code_that_is_not_its_own_is_a_finding(
    run_with: Run, code: str, acme: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "second"
    write_tool(folder, "second_tool", f"{TOOL}name='second', package='second', codes='second')")
    (folder / "second/codes").mkdir(parents=True)
    (folder / "second/__init__.py").write_text("")
    text = (ACME / "acme_tool/codes/ACME101.md").read_text()
    (folder / f"second/codes/{code}.md").write_text(text)
    done = run_with(f"{acme}:{folder}", tmp_path, "--help")
    assert findings(done) == ["TF922"]
    assert code in done.stderr


def test_a_command_whose_module_does_not_load_is_one_finding(
    run_with: Run, tmp_path: Path
) -> None:
    brings = "name='far', package='far', commands=(Command('far', 'Go far', 'not_there'),)"
    write_tool(tmp_path / "far", "far", f"{TOOL}{brings})")
    done = run_with(tmp_path / "far", tmp_path, "far")
    assert (done.returncode, findings(done)) == (2, ["TF921"])
    assert "Traceback" not in done.stderr


def test_foreign_tools_load_only_if_a_name_is_unknown(acme: Path, tmp_path: Path) -> None:
    code = "from tfcompose.cli import main; main(sys.argv[1:]); print('acme_tool' in sys.modules)"

    def loads(*arguments: str) -> bool:
        command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(acme)!r}); {code}"]
        done = processes.run([*command, *arguments], cwd=tmp_path, check=True)
        return done.stdout.splitlines()[-1] == "True"

    write_robot(tmp_path, "# fleet: fleet.yaml")
    assert not loads("lint")
    assert not loads("tree")
    assert loads("--help")
    write_robot(tmp_path, "acme: {frame: mast}")
    assert loads("lint")
