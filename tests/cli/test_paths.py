"""Paths that cannot be looked at.

Each command says so in one finding or sentence, and shows no traceback.
"""

import ast
import ctypes
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.bad_input import GOOD
from tests.support.cli import tfcompose_in
from tests.support.house import PACKAGE

NOBODY = 65_534
#: CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH.
OVERRIDES = 0b110
#: Each command that is given a path, PATH.
COMMANDS = {
    "lint": ("lint", "PATH"),
    "lint untrusted": ("lint", "--untrusted", "PATH"),
    "lint urdf": ("lint", "--urdf", "PATH"),
    "lint overlay": ("lint", "r.yaml", "--overlay", "PATH"),
    "build": ("build", "PATH"),
    "build output": ("build", "r.yaml", "--output", "PATH"),
    "tree": ("tree", "PATH"),
    "graph": ("graph", "PATH"),
    "graph output": ("graph", "r.yaml", "-o", "PATH/x.svg"),
    "diff": ("diff", "r.yaml", "PATH"),
    "explain": ("explain", "PATH"),
    "pose": ("pose", "PATH", "base_link", "base_link"),
    "up": ("up", "PATH"),
    "dry run": ("up", "--dry-run", "PATH"),
    "view": ("view", "PATH", "--html", "r.html"),
    "view output": ("view", "r.yaml", "--html", "PATH"),
    "help": ("help", "--html", "PATH"),
    "verify": ("verify", "PATH"),
    "verify bag": ("verify", "r.yaml", "--bag", "PATH"),
    "doctor": ("doctor", "PATH"),
    "tree bag": ("tree", "r.yaml", "--bag", "PATH"),
    "deploy": ("deploy", "PATH", "--check"),
    "deploy wheels": ("deploy", "r.yaml", "--check", "--wheels", "PATH"),
    "systemd": ("export", "systemd", "PATH"),
    "compose": ("export", "compose", "PATH", "--output", "PATH"),
    "k8s": ("export", "k8s", "PATH"),
    "launch": ("export", "launch", "PATH"),
    "all hosts": ("ps", "--all-hosts", "--file", "PATH"),
    "import urdf": ("import", "PATH.urdf"),
    "import xacro": ("import", "PATH.urdf.xacro"),
    "import launch": ("import", "PATH.launch.py"),
    "import script": ("import", "PATH.sh"),
    "import yaml": ("import", "PATH.yaml"),
    "import folder": ("import", "PATH"),
    "import output": ("import", "r.urdf", "--output", "PATH"),
    "import bag": ("import", "--bag", "PATH"),
    "init": ("init", "-o", "PATH"),
    "presets": ("presets", "PATH"),
    "fleet": ("fleet", "ps", "PATH"),
    "test": ("test", "PATH"),
    "args": ("build", "PATH", "--show-args"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """Return a folder with one in it that only somebody else may enter."""
    (tmp_path / "r.yaml").write_text(GOOD, "utf-8")
    (tmp_path / "r.urdf").write_text("<robot name='r'><link name='base_link'/></robot>", "utf-8")
    closed = tmp_path / "closed"
    closed.mkdir()
    (closed / "robot.yaml").write_text(GOOD, "utf-8")
    closed.chmod(0)
    if os.geteuid() == 0:
        os.chown(closed, NOBODY, NOBODY)
    yield tmp_path
    closed.chmod(0o700)


@contextmanager
def without_privileges() -> Iterator[None]:
    """Give up root's right to enter all folders (capset(2)), where the tests run as root."""
    if os.geteuid() != 0:
        yield
        return
    libc = ctypes.CDLL(None, use_errno=True)
    header = struct.pack("Ii", 0x20080522, 0)
    before = ctypes.create_string_buffer(24)
    assert libc.capget(header, before) == 0
    low, *rest = struct.unpack("6I", before.raw)
    assert libc.capset(header, struct.pack("6I", low & ~OVERRIDES, *rest)) == 0
    try:
        yield
    finally:
        assert libc.capset(header, before) == 0


@pytest.mark.parametrize(
    "path",
    ["closed/robot.yaml", "closed", "closed/none/r", "x" * 300, "r.yaml/x", "loop/x"],
)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_path_that_cannot_be_inspected_ends_in_no_traceback(
    command: str, path: str, folder: Path
) -> None:
    (folder / "loop").symlink_to("loop")
    argv = [word.replace("PATH", path) for word in COMMANDS[command]]
    with without_privileges():
        done = tfcompose_in(folder, *argv)
    assert done.returncode in {1, 2}, done.stdout + done.stderr
    output = done.stdout + done.stderr
    assert output or command == "up", "it builds in another process"
    assert "Traceback" not in output


#: What of a path asks the disk, and raises for one that may not be looked at.
ASKING = frozenset(
    {
        "is_file",
        "is_dir",
        "exists",
        "is_fifo",
        "read_text",
        "read_bytes",
        "iterdir",
        "glob",
        "rglob",
    }
)
#: Modules that may, and why.
EXCEPTIONS = {
    "cli/documentation.py": "its own data",
    "cli/templates.py": "its own data",
    "cli/compiling.py": "folders of presets and of the workspace, whose errors it takes for none",
    "cli/adjusting.py": "the run folder, of this user",
    "cli/runs.py": "the run folder, of this user",
    "cli/writing.py": "the folder that it writes, under an except",
    "cli/fixing.py": "the file that it is about to replace, whose errors the caller reports",
    "tools/adjust/calibrate.py": "where tools of this user write their results",
    "tools/deploy/agent.py": "runs alone on the robot's computer",
    "tools/deploy/connection.py": "its own data",
    "tools/deploy/release.py": "files that were looked at; the last net of main takes the rest",
    "tools/deploy/command.py": "wheels, as above",
    "tools/docs/option.py": "the folder that it writes, under an except",
    "tools/docs/site.py": "its own data",
    "tools/ros2/package.py": "its own data",
    "tools/treetest/inject_live.py": "the folder that the command has made for it",
    "tools/treetest/live_case.py": "as above",
    "tools/treetest/relaying.py": "as above",
    "tools/treetest/setup.py": "as above",
    "tools/treetest/pytest_plugin.py": "a file that pytest has found",
    "tools/treetest/started_robot.py": "the log that it has made itself",
    "tools/treetest/running.py": "the folder that it has made itself",
    "tools/view/page.py": "its own data",
    "tools/importers/launch_process.py": "runs confined, and answers errors",
    "tools/importers/launch_moveit.py": "runs confined",
    "tools/importers/launch_records.py": "runs confined, but for names that it shows",
    "tools/importers/launch_ros1.py": "runs confined",
}


def asking_calls(file: Path) -> list[str]:
    """Return the calls of a module that ask the disk about a path themselves."""
    return [
        f"{file.name}:{node.lineno}: {node.func.attr}"
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in ASKING
        and not (isinstance(node.func.value, ast.Name) and node.func.value.id in {"self", "disk"})
    ]


def test_commands_ask_the_disk_in_one_place() -> None:
    """``tfcompose.foundation.reading``, which turns what the disk says into findings."""
    files = [
        *(PACKAGE / "cli").rglob("*.py"),
        *(PACKAGE / "tools").rglob("*.py"),
        PACKAGE / "tf/bags.py",
    ]
    names = {file.relative_to(PACKAGE).as_posix(): asking_calls(file) for file in files}
    assert {name: calls for name, calls in names.items() if calls and name not in EXCEPTIONS} == {}
    assert {name for name in EXCEPTIONS if not names[name]} == set(), "exceptions that are none"
