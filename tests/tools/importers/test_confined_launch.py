"""Launch files of strangers: what they read and print, what a process sends they took over."""

import json
import os
import platform
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.bringups import import_of, needs_launch, places, printed_errors
from tfcompose.cli import main
from tfcompose.tools.importers import launch, launch_answer

HIDDEN = "root:x:0:0"
NODE = """
from launch import LaunchDescription
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([Node(package="a", executable="b", arguments=[repr(made)])])
"""


@pytest.fixture(autouse=True)
def _in_a_tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "secret.yaml").write_text(HIDDEN, "utf-8")
    (tmp_path / "tree").mkdir()
    monkeypatch.chdir(tmp_path / "tree")


def write(text: str, name: str = "a.launch.py") -> Path:
    file = Path(name)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def made_by(text: str, *words: str) -> Any:
    """Return what a launch file left in ``made``."""
    _, data = import_of(write(text + NODE), *words, code=None)
    return yaml.safe_load(data["processes"]["b"]["run"]["args"][0])


READ = """import glob, os, pathlib
made = {{}}
try:
    made["text"] = str({call})[:20]
except OSError as error:
    made["number"] = error.errno
"""


@needs_launch
@pytest.mark.parametrize(
    "call",
    [
        "open({file!r}).read()",
        "pathlib.Path({file!r}).read_text()",
        "os.read(os.open({file!r}, 0), 99)",
        "pathlib.Path({file!r}).read_bytes()",
        "os.listdir(os.path.dirname({file!r}))",
        "list(os.scandir(os.path.dirname({file!r})))",
    ],
)
@pytest.mark.parametrize(
    "file", ["/etc/passwd", "../secret.yaml", "link.yaml", "/proc/self/environ", "/proc/1/environ"]
)
def test_what_lies_outside_is_not_read_and_named(
    call: str, file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("link.yaml").symlink_to(tmp_path / "secret.yaml")
    if file == "link.yaml" and "dirname" in call:
        file = "../"
    made = made_by(READ.format(call=call.format(file=file)))
    assert made == {"number": 13}
    printed = printed_errors(capsys)
    assert places(printed, "TF020") == ["a.launch.py:4"]
    assert HIDDEN not in printed


#: It takes the hook off by which Python refuses.
NATIVE = """import ctypes, os
import tfcompose.tools.importers.launch_process as reader
reader._READS = reader._REFUSED = frozenset()
libc = ctypes.CDLL(None, use_errno=True)
made = {}
for file in ("/etc/passwd", "../secret.yaml", "/proc/self/environ", os.path.expanduser("~")):
    made[file] = [libc.open(file.encode(), 0), ctypes.get_errno()]
"""


@needs_launch
@pytest.mark.skipif(
    platform.machine() not in {"x86_64", "aarch64"}, reason="the kernel confines on these two"
)
def test_the_kernel_opens_nothing_outside() -> None:
    assert set(map(tuple, made_by(NATIVE).values())) == {(-1, 13)}


@needs_launch
def test_environment_modules_and_neighbours_are_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SETTING", "set")
    neighbour = tmp_path / "neighbour"
    write("<package><name>neighbour</name></package>", str(neighbour / "package.xml"))
    write("kept", str(neighbour / "config/a.yaml"))
    made = made_by("""import os, numpy, xml.etree.ElementTree, datetime, threading
import random, tempfile, uuid
from ament_index_python.packages import get_package_share_directory
folder = get_package_share_directory("neighbour")
text = open(folder + "/config/a.yaml").read()
made = [os.environ["SETTING"], text, sorted(os.listdir(folder)), os.path.exists("a.launch.py")]
""")
    assert made == ["set", "kept", ["config", "package.xml"], True]


@needs_launch
def test_a_folder_for_compiled_files_is_no_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONPYCACHEPREFIX", str(tmp_path / "pyc"))
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    assert made_by("made = 1") == 1
    assert "may not read" not in printed_errors(capsys)


@needs_launch
def test_a_launch_file_that_lies_outside_is_not_included(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    write("<launch><node pkg='far' exec='away'/></launch>", str(tmp_path / "far/far.launch.xml"))
    file = write(
        f"<launch><include file='{tmp_path}/far/far.launch.xml'/>\n"
        "<node pkg='a' exec='b'/></launch>",
        "a.launch.xml",
    )
    _, data = import_of(file, code=None)
    assert set(data["processes"]) == {"b"}
    assert "may not read" in printed_errors(capsys)
    _, data = import_of(file, "--package", f"far={tmp_path}/far", code=None)
    assert set(data["processes"]) == {"away", "b"}


@needs_launch
def test_parameters_of_a_file_outside_are_not_read(tmp_path: Path) -> None:
    write("/hidden_node: {ros__parameters: {a: 1}}\n", str(tmp_path / "far/a.yaml"))
    write("/seen_node: {ros__parameters: {a: 1}}\n", "b.yaml")
    nodes = "".join(
        f'<node pkg="p" exec="e"><param from="{file}"/></node>'
        for file in (f"{tmp_path}/far/a.yaml", "$(dirname)/b.yaml")
    )
    _, data = import_of(write(f"<launch>{nodes}</launch>", "a.launch.xml"), code=None)
    assert "seen_node" in data["processes"]
    assert "hidden_node" not in data["processes"]


@needs_launch
@pytest.mark.parametrize("file", ["/dev/zero", "pipe"])
def test_a_parameter_file_that_has_no_end_is_not_waited_for(file: str) -> None:
    os.mkfifo("pipe")
    params = f'<param name="a" value="1"/><param from="{file}"/>'
    text = f'<launch><node pkg="p" exec="e">{params}</node></launch>'
    _, data = import_of(write(text, "a.launch.xml"), code=None)
    assert "e" in data["processes"]


XACRO = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><link name="base_link"/>
<link name="a${(lambda: [c for c in ().__class__.__base__.__subclasses__()
if c.__name__ == '_wrap_close'][0].__init__.__globals__['system']('touch made'))()}"/></robot>
"""


@needs_launch
@pytest.mark.parametrize(
    "text",
    [
        """from launch import LaunchDescription
from launch.substitutions import Command
from launch_ros.actions import Node
def generate_launch_description():
    name = "robot_state_publisher"
    return LaunchDescription([Node(package=name, executable=name,
        parameters=[{"robot_description": Command(["xacro ", "FOLDER/r.urdf.xacro"])}])])
""",
        """<launch><node pkg="robot_state_publisher" exec="robot_state_publisher">
<param name="robot_description" value="$(command 'xacro FOLDER/r.urdf.xacro')"/>
</node></launch>""",
    ],
)
def test_a_launch_file_does_not_get_out_through_a_xacro_file(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    write(XACRO, "r.urdf.xacro")
    name = "a.launch.py" if "import" in text else "a.launch.xml"
    main(["import", str(write(text.replace("FOLDER", str(Path.cwd())), name))])
    assert "TF022" in printed_errors(capsys)
    assert not Path("made").exists()


@needs_launch
def test_what_it_prints_is_shown_without_control_characters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    made_by(
        'import sys\nmade = 1\nprint("\\x1b]52;c;aWQ=\\x07one")\n'
        'sys.stderr.write("::error::two\\n")'
    )
    printed = capsys.readouterr().err
    assert "\x1b" not in printed
    assert [line for line in printed.splitlines() if "::error" in line] == [
        "a.launch.py: ::error::two"
    ]


@needs_launch
def test_a_flood_of_output_is_bounded(capsys: pytest.CaptureFixture[str]) -> None:
    made_by('made = 1\nfor _ in range(10_000):\n    print("x" * 1000)')
    assert 1_000_000 < len(capsys.readouterr().err) < 1_200_000


@needs_launch
def test_with_trust_it_reads_what_its_user_reads() -> None:
    made = made_by(READ.format(call="open('../secret.yaml').read()"), "--trust")
    assert made == {"text": HIDDEN}


def _record(**more: Any) -> dict[str, Any]:
    return {
        "kind": "node",
        "at": ["", 1],
        "id": 1,
        "env": {},
        "period": 0.0,
        "after": {},
        "package": "a",
        "executable": "b",
        "name": None,
        "label": None,
        "namespace": None,
        "argv": [],
        "params": [],
        "remap": [],
        **more,
    }


def _answer(*records: Any, **more: Any) -> dict[str, Any]:
    return {"answer": {"records": list(records), "stopped": "", "line": 0, "decided": [], **more}}


HOSTILE: dict[str, Any] = {
    "nothing": None,
    "a list": [],
    "no answer": {"answer": 7},
    "no records": {"answer": {}},
    "a record that is none": _answer(7),
    "a kind that there is not": _answer(_record(kind="whatever")),
    "no kind": _answer({}),
    "a place elsewhere": _answer(
        {"kind": "todo", "at": ["../secret.launch.py", 1], "text": "see"}
    ),
    "a place of one part": _answer({"kind": "todo", "at": ["../secret.launch.py"], "text": "see"}),
    "a place the wrong way round": _answer(
        {"kind": "todo", "at": [1, "../secret.launch.py"], "text": "see"}
    ),
    "a place far below": _answer({"kind": "todo", "at": ["", 10**9], "text": "see"}),
    "stopped for a long reason": _answer(_record(), stopped="x" * 10**6, line=10**12),
    "names that are numbers": _answer(_record(package=7)),
    "arguments that are none": _answer(_record(argv=[None])),
    "half a rule": _answer(_record(remap=[["a"]])),
    "an endless period": _answer(_record(period=float("inf"))),
    "no period": _answer(_record(period=float("nan"))),
    "a long period": _answer(_record(period=10**400)),
    "endless tries": _answer(
        _record(respawn=True, respawn_max_retries=float("inf"), respawn_delay=float("inf"))
    ),
    "many tries": _answer(_record(respawn=True, respawn_max_retries=10**400)),
    "deep parameters": _answer(_record(params=[{"a": [[[[]]]]}])),
    "parameters that are mappings": _answer(_record(params=[{"a": {"b": {}}}])),
    "a node of no name that ends": _answer({"kind": "required", "at": [], "node": "x"}),
    "an argument without choices": _answer(
        {"kind": "argument", "at": [], "name": "a", "value": "b"}
    ),
    "lines": _answer(
        {"kind": "todo", "at": ["", 1], "text": "a\nlinks: {evil: {}}\rjoints: {}\u2028xml: {}"},
        {"kind": "skipped", "at": ["", 1], "text": "a\nlinks: {evil: {}}"},
        _record(name="a\nb: {}", when=["a\nlinks: {evil: {}}"]),
    ),
    "half characters": _answer(_record(name="\ud800", argv=["\udcff"])),
    "control characters": _answer(_record(name="a\x1b[2J\x00", argv=["\x1b]0;a\x07"])),
    "a description elsewhere": _answer(
        _record(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            argv=["../secret.urdf"],
        )
    ),
    "a description of what is elsewhere": _answer(
        _record(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            params=[{"robot_description": {"parts": [{"file": "../secret.urdf", "args": {}}]}}],
        )
    ),
    "a text of parts that are none": _answer(_record(argv=[{"parts": [{"file": 7}]}])),
    "a text of no parts": _answer(_record(argv=[{"parts": []}, {"parts": [""]}])),
    "a text without parts": _answer(_record(argv=[{"text": "a"}])),
    "an argument that is not declared": _answer(
        _record(argv=[{"parts": [{"argument": "}${a\nlinks: {evil: {}}", "value": "b"}]}])
    ),
}


@pytest.mark.parametrize("line", HOSTILE.values(), ids=HOSTILE)
def test_a_process_that_was_taken_over_shows_no_other_file(
    line: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(launch_answer, "PROCESS", "tests.support.hostile_child")
    monkeypatch.setattr(launch, "has_launch", lambda: True)
    robot = f"<robot name='r'><link name='{HIDDEN}'/></robot>\n"
    Path("../secret.urdf").write_text(robot, "utf-8")
    program = f"HIDDEN = '{HIDDEN}'\ndef generate_launch_description():\n    pass\n"
    Path("../secret.launch.py").write_text(program, "utf-8")
    write("" if line is None else json.dumps(line) + "\n", "hostile.jsonl")
    write("\n", "a.launch.py")
    try:
        main(["import", "a.launch.py"])
    except SystemExit as error:
        assert error.code in {1, 2}  # noqa: PT017 (either is no traceback)
    printed = capsys.readouterr()
    assert not re.search(r"^ *(links|joints|xml)", printed.out, re.MULTILINE)
    assert HIDDEN not in printed.out + printed.err
    assert "\x1b" not in printed.out + printed.err
    assert "Traceback" not in printed.err
