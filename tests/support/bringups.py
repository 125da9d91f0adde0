"""Importing what starts a robot, and compiling what import writes."""

import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.importing import PRESETS
from tfcompose.cli import main
from tfcompose.cli.compiling import disk
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.foundation.findings import Span
from tfcompose.model.robot import AsInFile, Robot
from tfcompose.spec.language import ArgValue, BuildInputs
from tfcompose.spec.load import load

#: ROS's own launch reads launch files, and comes with a distribution only.
needs_launch = pytest.mark.skipif(
    find_spec("launch_ros") is None, reason="launch is not installed"
)
#: What a build writes of the parameters of a process.
_PARAMETER_FILE = re.compile(r"/[^ ]*/params/\w+\.yaml")


def import_of(source: Path, *words: str, code: int | None = 0) -> tuple[str, dict[str, Any]]:
    """Return the robot file that import writes for a source, and its data."""
    out = source.with_name("imported.yaml")
    got = main(["import", str(source), *words, "-o", str(out), "--force"])
    assert code is None or got == code, out.read_text("utf-8") if out.exists() else got
    text = out.read_text("utf-8")
    return text, load(text, str(out)).data


def compiled(text: str, folder: Path, **args: str) -> Compiled:
    """Compile a robot file with the values of its arguments."""
    inputs = BuildInputs({name: ArgValue(value, Span("test")) for name, value in args.items()})
    return compile_robot(
        text, str(folder / "imported.yaml"), PRESETS, read=read_text, disk=disk(), inputs=inputs
    )


def exported(robot: Path, out: Path) -> Path:
    """Return the launch file that a robot file is exported to."""
    assert main(["export", "launch", str(robot), "-o", str(out)]) == 0
    (file,) = (out / "launch").glob("*.launch.py")
    return file


def _as_read(value: Any) -> Any:
    if isinstance(value, list):
        return [_as_read(item) for item in value]
    return yaml.safe_load(value) if isinstance(value, AsInFile) else value


def flat(params: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Return parameters by their full names."""
    parameters: dict[str, Any] = {}
    for key, value in params.items():
        parameters |= (
            flat(value, f"{above}{key}.")
            if isinstance(value, dict)
            else {f"{above}{key}": _as_read(value)}
        )
    return parameters


def started_with(robot: Robot) -> dict[str, dict[str, Any]]:
    """Return what each process is started with, by its name.

    Launch files, which have none in launch, by theirs.

    Parameters have their types: 20.0 is not 20.
    """
    programs: dict[str, dict[str, Any]] = {}
    for process in robot.processes:
        params = flat(process.ros_nodes[0].params) if process.ros_nodes else {}
        if process.component:
            (container,) = (
                candidate
                for candidate in robot.processes
                if process.component and candidate.name == process.component.container
            )
            programs[process.name] = {
                "program": f"{process.component.package}/{process.component.plugin}",
                "container": container.node,
                "node": process.node,
                "remap": process.remap,
                "params": {key: repr(value) for key, value in sorted(params.items())},
                "extra_arguments": process.component.extra_arguments,
            }
        if process.kind != "run":
            continue
        program = (
            f"{process.package}/{process.executable}"
            if process.package
            else process.launch or process.argv[0]
        )
        is_ros_process = process.package or process.launch
        same = sum(bringup["program"] == program for bringup in programs.values())
        programs[f"{program} {same}" if process.launch else process.name] = {
            "program": program,
            "words": [
                _PARAMETER_FILE.sub("${params_file}", word)
                for word in (process.argv if is_ros_process else process.argv[1:])
            ],
            "namespace": (
                process.ros_nodes[0].name.rpartition("/")[0].strip("/") if process.package else ""
            ),
            "remap": process.remap,
            "env": process.env,
            "output": (
                process.output,
                process.emulate_tty,
                process.stop.timeout_s,
                process.stop.kill_timeout_s,
            ),
            "params": (
                {}
                if process.launch
                else {key: repr(value) for key, value in sorted(params.items())}
            ),
        }
    return programs


def places(printed: str, code: str) -> list[str]:
    """Return the files and lines of the findings with a code that a command printed."""
    heads = [line.partition(": ")[0] for line in printed.splitlines() if f"[{code}]" in line]
    return [":".join(Path(head).name.split(":")[:2]) for head in heads]


def printed_errors(capsys: pytest.CaptureFixture[str]) -> str:
    """Return what was printed to stderr since the last call."""
    return capsys.readouterr().err
