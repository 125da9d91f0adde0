"""What is imported of launch files is what ROS's launch would start; where launch is installed."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.importing.test_launch import MORE, WITH_ARGUMENTS, XML, YAML
from tests.support.bringups import compiled, import_of
from tfcompose.model import AsInFile

pytestmark = pytest.mark.skipif(find_spec("launch_ros") is None, reason="launch is not installed")
SCRIPT = Path(__file__).parents[1] / "support/real_launch.py"
#: XML without what launch refuses.
SOUND_XML, SOUND_YAML = XML.replace("  <bogus/>\n", ""), YAML.replace("- bogus: {}\n", "")


def started(file: Path, *words: str) -> dict[str, dict[str, Any]]:
    """Return what launch starts, by the node's name, or by the command: words, names, remappings, parameters."""
    out = file.with_name("started.json")
    environment = {**os.environ, "ROS_LOG_DIR": str(file.parent)}
    subprocess.run([sys.executable, SCRIPT, out, file, *words], check=True, env=environment, capture_output=True)
    return dict(one_of(one["words"], one["params"]) for one in json.loads(out.read_text("utf-8")))


def one_of(words: list[str], files: list[dict[str, Any]]) -> tuple[str, dict[str, Any]]:
    program = next((word for word in words if "/" in word), words[0])
    rest = words[words.index(program) + 1 :]
    at = rest.index("--ros-args") if "--ros-args" in rest else len(rest)
    rules = [right for left, right in zip(rest[at:], rest[at + 1 :], strict=False) if left == "-r"]
    remap = dict(rule.split(":=", 1) for rule in rules)
    name, namespace = remap.pop("__node", ""), remap.pop("__ns", "/")
    params: dict[str, Any] = {}
    for file in files:
        for node in file.values():
            params |= {key: _plain(value) for key, value in node["ros__parameters"].items()}
    return name or program, {"program": program, "words": rest[:at], "namespace": namespace.strip("/"), "remap": remap,
                             "params": params}  # fmt: skip


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _as_read(value: Any) -> Any:
    return yaml.safe_load(value) if isinstance(value, AsInFile) else value


def imported(file: Path, *words: str) -> dict[str, dict[str, Any]]:
    """Return the same of the robot that import makes of the file."""
    text, _ = import_of(file, *words, code=None)
    robot = compiled(text, file.parent).robot
    assert robot
    several = {}
    for process in robot.processes:
        if process.kind != "run":
            continue
        program = f"{process.package}/{process.executable}" if process.package else process.argv[0]
        several[process.name if process.package else program] = {
            "program": program,
            "words": list(process.argv if process.package else process.argv[1:]),
            "namespace": process.ros_nodes[0].name.rpartition("/")[0].strip("/"),
            "remap": process.remap,
            "params": {key: _as_read(value) for key, value in process.ros_nodes[0].params.items()},
        }
    return several


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("rover.launch.xml", SOUND_XML, ()),
        ("rover.launch.yaml", SOUND_YAML, ("name:=left",)),
        ("a.launch.py", WITH_ARGUMENTS, ("loud:=false", "mode:=fixed")),
    ],
)
def test_each_process_is_started_as_launch_would(
    name: str, text: str, words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prefix = tmp_path / "install"
    index, share = prefix / "share/ament_index/resource_index/packages", prefix / "share/rover"
    index.mkdir(parents=True)
    share.mkdir()
    (index / "rover").touch()
    (share / "drive.yaml").write_text("/**: {ros__parameters: {speed: 1.5}}\n", encoding="utf-8")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{prefix}:{os.environ.get('AMENT_PREFIX_PATH', '')}")
    (tmp_path / "more.launch.xml").write_text(MORE, encoding="utf-8")
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    expected, found = started(file, *words), imported(file, *words)
    expected = {key: one for key, one in expected.items() if not one["program"].endswith("/static_transform_publisher")}
    assert expected
    assert found.keys() == expected.keys()
    for key, one in expected.items():
        assert found[key] == one, key
