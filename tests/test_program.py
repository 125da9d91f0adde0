"""No process of tfcompose's own imports a file of the folder that it is started in."""

import os
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.user_files import PYTHON_PATH, write_namesakes
from tfcompose.launcher.program import HERE, anywhere, without_current_folder


def run(folder: Path, *words: str, python_path: str | None = None) -> tuple[int, str]:
    """Return the exit code and the output of a program that is started in the folder."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    more = {} if python_path is None else {"PYTHONPATH": python_path}
    done = processes.run(list(words), cwd=folder, env=env | more)
    return done.returncode, done.stdout + done.stderr


#: ``guard`` with a file, or without arguments, is the command.
USAGE = {"guard": ["guard", "no", "such", "arguments"]}
KINDS = ("static", "joints", "simulate", "guard", "exec")


@pytest.mark.parametrize(
    ("start", "kind"), [*((HERE, kind) for kind in KINDS), (anywhere(sys.executable), "exec")]
)
def test_a_process_imports_no_file_of_the_current_folder(
    start: list[str], kind: str, tmp_path: Path
) -> None:
    write_namesakes(tmp_path)
    code, output = run(tmp_path, *start, *USAGE.get(kind, [kind]))
    assert (code, f"usage: tfcompose {kind} " in output) == (2, True), output


@pytest.mark.parametrize("python_path", [PYTHON_PATH, ":/no/such/folder", ".", "lib/.."])
def test_python_path_does_not_give_a_process_the_current_folder(
    python_path: str, tmp_path: Path
) -> None:
    write_namesakes(tmp_path, loaded_first=False)
    (tmp_path / "tfcompose").mkdir()
    for start in (HERE, anywhere(sys.executable)):
        code, output = run(tmp_path, *start, *USAGE["guard"], python_path=python_path)
        assert (code, "usage: tfcompose guard " in output) == (2, True), output


def test_a_command_imports_no_file_of_the_current_folder(tmp_path: Path) -> None:
    script = tmp_path / "bin" / "tfcompose"
    script.parent.mkdir()
    script.write_text("import sys\nfrom tfcompose.__main__ import main\nsys.exit(main())\n")
    write_namesakes(tmp_path, loaded_first=False)
    write_namesakes(script.parent, loaded_first=False)
    python_path = f"{Path(__file__).parents[1]}:"
    for words in ([str(script)], ["-m", "tfcompose"], ["-c", anywhere("")[2]]):
        command = [sys.executable, *words, "lint", "no.yaml"]
        code, output = run(tmp_path, *command, python_path=python_path)
        assert (code, "no.yaml" in output) == (2, True), output


def test_a_checkout_on_a_relative_python_path_runs_from_its_own_folder(tmp_path: Path) -> None:
    (tmp_path / "tfcompose").symlink_to(Path(__file__).parents[1] / "tfcompose")
    command = [sys.executable, "-S", "-m", "tfcompose", "--version"]
    code, output = run(tmp_path, *command, python_path=".")
    assert (code, output.partition(" ")[0]) == (0, "tfcompose")


def test_what_the_robots_programs_find_stays() -> None:
    env = {"PYTHONPATH": "/a::/b:.:lib", "HOME": "/root"}
    assert without_current_folder(env) == {"PYTHONPATH": "/a:/b:lib", "HOME": "/root"}
    assert without_current_folder({"PYTHONPATH": ":"}) == {}
    assert without_current_folder({}) == {}
