"""The README and the topics say what the code says."""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from PIL import Image

from tests.benchmarks import pages, record
from tests.support import pictures, processes
from tests.support.cli import tfcompose_in
from tfcompose.cli.compiling import library
from tfcompose.cli.documentation import FOLDER, for_terminal, page, topic, topics
from tfcompose.cli.parser import all_commands, parser_of
from tfcompose.cli.terminal import plain
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tool import shipped_tools
from tfcompose.launcher.program import PROCESSES

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS, TOPICS = all_commands(), topics()
FOLDERS = (FOLDER, *(tool.topic_folder for tool in shipped_tools().tools))
PAGES = {file.stem: file.read_text("utf-8") for folder in FOLDERS for file in folder.glob("*.md")}
RECORD = record.read()
EVERYTHING = "\n".join((README, *PAGES.values()))


def blocks(language: str, text: str = README) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_its_pictures_are_small_and_show_the_robot_file_of_today() -> None:
    pictured = {Path(path).name for path in re.findall(r"!\[.+?\]\((\S+)\)", README)}
    assert pictured == {file.name for file in pictures.FOLDER.iterdir()} == {"up.png", "view.png"}
    for file in pictures.FOLDER.iterdir():
        assert file.stat().st_size <= 200_000
        with Image.open(file) as image:
            assert image.info[pictures.ROBOT_HASH] == pictures.robot_hash()


def test_it_is_one_read() -> None:
    assert len(README.encode()) < 15_000


def test_its_table_of_topics_is_that_of_the_code() -> None:
    section = README.partition("| topic | |\n")[2].partition("\n\n")[0]
    assert dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", section, re.MULTILINE)) == TOPICS


def test_every_page_is_a_topic_or_a_command_and_starts_with_its_title() -> None:
    assert PAGES.keys() >= TOPICS.keys()
    assert PAGES.keys() <= TOPICS.keys() | COMMANDS.keys()
    for name, text in PAGES.items():
        assert re.match(r"# \S.*\n\n", text), name
        assert "](#" not in text, f"{name} has a link into the README"


def test_every_command_and_topic_that_is_named_is_there() -> None:
    for text in (README, *PAGES.values()):
        named = set(re.findall(r"(?:^\$ |`)tfcompose ([a-z]+)\b", text, re.MULTILINE))
        assert named <= COMMANDS.keys() | PROCESSES.keys()
        for word in re.findall(r"tfcompose help ([a-z.]+[a-z])", text):
            assert page(word, COMMANDS), word


def test_help_prints_topics_and_commands(tmp_path: Path) -> None:
    for word in (*TOPICS, *COMMANDS):
        done = tfcompose_in(tmp_path, "help", word)
        assert (done.returncode, done.stderr) == (0, "")
        assert PAGES.get(word, "")[:40] in done.stdout
    assert all(code in tfcompose_in(tmp_path, "help", "codes").stdout for code in CATALOGUE)
    near = tfcompose_in(tmp_path, "help", "calibraton")
    assert (near.returncode, "calibration?" in near.stderr) == (2, True)


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tfcompose", *arguments]
    return processes.run(command, cwd=cwd)


@pytest.fixture
def rover(tmp_path: Path) -> Path:
    (tmp_path / "rover.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_pages_fit_a_terminal(columns: int) -> None:
    for word in ("sensors", "processes", "hosts", "verify"):
        text = for_terminal(page(word, COMMANDS) or "", columns)
        assert max(map(len, text.splitlines())) <= max(columns, 80)  # argparse's usage
        assert "|---" not in text
        assert "](#" not in text
        assert "\n\n\n" not in text
        bold = for_terminal(page(word, COMMANDS) or "", columns, coloured=True)
        assert [plain(line).rstrip() for line in bold.splitlines()] == text.splitlines()


def test_words_of_the_robot_file_are_bold_in_a_terminal() -> None:
    assert "\033[1mrestart: on-failure\033[0m" in for_terminal(
        PAGES["processes"], 120, coloured=True
    )


def test_its_robot_has_no_findings(rover: Path) -> None:
    done = run("lint", "rover.yaml", cwd=rover)
    assert (done.returncode, "[TF" in done.stdout) == (0, False)


def test_its_robot_gives_the_edges_and_owners_that_up_prints(rover: Path) -> None:
    done = run("tree", "rover.yaml", "-p", "demo", cwd=rover)
    owners = Counter(words[2] for words in map(str.split, _edges(done.stdout)))
    printed = re.findall(r"live  (\S+) \(\S+\): (\d+ edges|\S+ → \S+)  ", blocks("console")[0])
    assert {
        owner: int(edges.split()[0]) if "edges" in edges else 1 for owner, edges in printed
    } == owners
    assert f"tree complete: {owners.total()} edges" in README


def _edges(tree: str) -> list[str]:
    return [re.sub(r"^[│├└─ ]+", "", line) for line in tree.splitlines()[1:]]


def test_its_lint_output_is_what_lint_prints(rover: Path) -> None:
    (block,) = (block for block in blocks("console") if block.startswith("$ tfcompose lint"))
    expected = block.removeprefix("$ tfcompose lint rover.yaml\n")
    broken = (
        blocks("yaml")[0]
        .replace("owner: base_drive", "owner: base_driv")
        .replace("15 deg}  ", "15 degr} ", 1)
    )
    (rover / "rover.yaml").write_text(broken, encoding="utf-8")
    printed = run("lint", "rover.yaml", cwd=rover).stdout
    assert [line.rstrip() for line in printed.splitlines()] == [
        line.rstrip() for line in expected.splitlines()
    ]


def test_its_calibrated_robot_is_linted_and_explained_as_printed(tmp_path: Path) -> None:
    robot, measured, _ = blocks("yaml", PAGES["calibration"])
    (tmp_path / "cell.yaml").write_text(robot, encoding="utf-8")
    (tmp_path / "camera.calib").write_text(measured, encoding="utf-8")
    done = run("lint", "cell.yaml", "--fail-on", "warning", cwd=tmp_path)
    assert (done.returncode, "[TF" in done.stdout) == (0, False)
    command, _, printed = blocks("console", PAGES["calibration"])[0].partition("\n")
    assert run(*command.removeprefix("$ tfcompose ").split(), cwd=tmp_path).stdout == printed


def test_its_preset_of_ones_own_has_no_findings(tmp_path: Path) -> None:
    _, preset = blocks("yaml", PAGES["presets"])
    file = tmp_path / "presets/waterlinked/dvl-a50.yaml"
    file.parent.mkdir(parents=True)
    file.write_text(preset, encoding="utf-8")
    robot = "tfcompose: 1\nrobot: r\npreset_path: [presets]\nlinks: {base_link: {}}\n"
    dvl = "sensors: {dvl: {preset: waterlinked/dvl-a50, parent: base_link}}\n"
    (tmp_path / "robot.yaml").write_text(robot + dvl, encoding="utf-8")
    done = run("lint", "--fail-on", "warning", cwd=tmp_path)
    assert (done.returncode, "[TF" in done.stdout) == (0, False), done.stdout


#: The topics about the robot file, as the page ``language`` lists them.
LISTED = re.findall(r"^\| `tfcompose help (\w+)`", PAGES["language"], re.MULTILINE)
OF_THE_LANGUAGE = ("language", *LISTED)


def test_the_language_has_eight_topics() -> None:
    assert len(LISTED) == 8
    assert set(LISTED) <= TOPICS.keys()


#: Pages with an example that is a file: its first line is its name.
WITH_FILES = [
    name
    for name, text in PAGES.items()
    if re.search(r"^```yaml\n# \S+\.yaml$", text, re.MULTILINE)
]
#: Commands whose output depends on files alone.
REPEATABLE = ("pose", "explain", "tree", "lint", "diff", "export")


@pytest.mark.parametrize("name", WITH_FILES)
def test_its_examples_have_no_findings_and_print_what_stands_there(
    name: str, tmp_path: Path
) -> None:
    texts = [text for text in blocks("yaml", PAGES[name]) if re.match(r"# \S+\.yaml\n", text)]
    files = {text.partition("\n")[0].removeprefix("# "): text for text in texts}
    assert len(files) == len(texts)
    for file, text in files.items():
        assert max(map(len, text.splitlines())) < 80
        (tmp_path / file).write_text(text, encoding="utf-8")
    robots = [file for file, text in files.items() if "\nrobot: " in text]
    assert "robot.yaml" in robots
    done = run("lint", *robots, "--fail-on", "warning", cwd=tmp_path)
    assert (done.returncode, "[TF" in done.stdout) == (0, False), done.stdout
    for block in blocks("console", PAGES[name]):
        command, _, printed = block.removeprefix("$ tfcompose ").partition("\n")
        if command.startswith(REPEATABLE):
            assert run(*command.split(), cwd=tmp_path).stdout == printed


@pytest.mark.parametrize("name", OF_THE_LANGUAGE)
def test_a_topic_of_the_language_begins_with_its_example(name: str) -> None:
    assert name in WITH_FILES
    assert name == "language" or PAGES[name].partition("\n\n")[2].startswith("```yaml\n# ")


def test_a_topic_with_the_name_of_a_key_ends_with_the_key() -> None:
    text = page("parts", COMMANDS) or ""
    assert text.startswith(PAGES["parts"])
    assert "\n## Part\n" in text


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_says_what_it_does_and_what_its_arguments_are(command: str) -> None:
    parser = parser_of(command)
    assert parser.description
    assert parser.description.strip().endswith(".")
    for action in parser._actions:
        assert action.help, f"{command} {action.dest} has no help"


def test_its_first_commands_are_those_that_init_names(tmp_path: Path) -> None:
    (block,) = (block for block in blocks("console") if block.startswith("$ tfcompose init"))
    assert tfcompose_in(tmp_path, "init").stdout == block.partition("\n")[2]


def test_its_codes_are_known() -> None:
    assert set(re.findall(r"TF\d{3}", EVERYTHING)) <= set(CATALOGUE)


def test_the_presets_that_the_pages_name_are_there() -> None:
    names = library().names
    match = re.search(r"^A sensor's preset is (.*)$", PAGES["presets"], re.MULTILINE)
    assert match
    assert set(re.findall(r"`([a-z0-9]+/[a-z0-9-]+)`", match[1])) <= set(names)
    assert all(f"| {name.partition('/')[0]} |" in topic("presets") for name in names)


def test_it_has_exactly_the_two_commands_that_ci_takes_out_of_it() -> None:
    commands = re.findall(r"^python3 -m venv .*&&.*$", README, re.MULTILINE)
    assert len(commands) == 2
    assert commands[0].endswith("tfcompose up robots/autonomous_robot.yaml --profile demo")
    assert commands[1].endswith("pytest")
    assert all("pip install -c constraints.txt -e " in command for command in commands)


def test_its_tables_are_those_of_the_record() -> None:
    for text in (README, *PAGES.values()):
        assert pages.with_tables(text, RECORD) == text, "python -m tests.benchmarks.pages"


def test_every_recorded_benchmark_is_printed_and_says_where_it_is_from() -> None:
    assert pages.quoted(EVERYTHING) >= RECORD.keys()
    for name, result in RECORD.items():
        assert result.command == f"python -m tests.benchmarks --only {name}"
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", result.date)
        assert min(result.load) >= 0
        assert {"processor", "cores", "memory_gb", "system", "python"} == result.machine.keys()


#: Measures of time, memory and processors, as prose and tables write them; what an example prints
#: stands in blocks.
FIGURE = r"\d[\d,.]* (?:µs|ms|MB)\b|\d % of a core|\d times as (?:long|fast)|\d times faster"
#: Figures that are settings or limits of the program, and no measurements.
SET = {"8 MB", "1 MB", "64 MB", "100 ms"}


def test_no_other_figure_is_printed() -> None:
    prose = re.sub(r"^```.*?^```", "", EVERYTHING, flags=re.MULTILINE | re.DOTALL)
    recorded = "".join(map(pages.tables_of, (README, *PAGES.values())))
    assert [
        figure
        for figure in re.findall(FIGURE, prose)
        if figure not in SET and figure not in recorded
    ] == []


def test_its_python_programs_run_and_give_what_they_say() -> None:
    imports, program = blocks("python", PAGES["python"])[:2]
    after = (
        "print(round(pose.xyz[0], 9), stamp_ns, xyz.shape, quat_xyzw.shape, round(points[0,"
        " 0], 9))"
    )
    done = processes.run([sys.executable, "-c", imports + program + after], check=True)
    assert done.stdout == "4.7 9000000000 (80, 3) (80, 4) 3.7\n"
