"""An existing launch file as one process: ``ros2 launch`` of a wrapper around it.

``${launch:PACKAGE/FILE}`` as the first word of an ``argv`` is the file in PACKAGE's share folder, anywhere below it, or
at the path that is written.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.run.launcher import launch_wrapper
from tfcompose.run.launcher.executable import NotFound

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.plan import PlanProcess, RosSettings

_LAUNCH = re.compile(r"\$\{launch:([^/}]+)/([^}]+)\}")
_OUTPUT = "OVERRIDE_LAUNCH_PROCESS_OUTPUT"
_KINDS = ("*launch.py", "*launch.xml", "*launch.yaml", "*launch.yml")


def is_launch(word: str) -> bool:
    """Return whether the word means a launch file."""
    return _LAUNCH.fullmatch(word) is not None


def launch_command(
    process: PlanProcess, ros: RosSettings, argv: tuple[str, ...], env: Mapping[str, str]
) -> tuple[tuple[str, ...], dict[str, str]] | NotFound | Finding:
    """Return the command and what its environment needs besides, or what is missing or wrong."""
    meant = _LAUNCH.fullmatch(argv[0])
    package, name = (meant[1], meant[2]) if meant else ("", "")
    path = env.get("PATH", os.defpath)
    ros2 = shutil.which("ros2", path=path)
    if ros2 is None:
        advice = "source the setup file of your ROS installation first; ros2 launch comes with the package ros2launch"
        return NotFound(process.name, f"ros2 (for launch {package}/{name})", (), path, advice)
    file = _find(process, package, name, env)
    if isinstance(file, NotFound):
        return file
    arguments = dict(word.split(":=", 1) for word in argv[1:] if ":=" in word)
    odd = [word for word in argv[1:] if ":=" not in word]
    if odd:
        message = f"{process.name}: {odd[0]} is no argument of a launch file"
        return finding("TF902", message, None, help="give name: value, or name:=value")
    given = {
        "file": str(file),
        "arguments": arguments,
        "namespace": ros.namespace if process.namespace is None else process.namespace,
        "remap": process.remap,
        "sim_time": ros.clock == "sim",
    }
    wrapper = str(Path(launch_wrapper.__file__).absolute())
    # Without being told, ros2 launch keeps what its nodes say to files of its own.
    more = {launch_wrapper.LAUNCH: json.dumps(given, sort_keys=True), _OUTPUT: env.get(_OUTPUT) or "both"}
    return (ros2, "launch", "--noninteractive", wrapper), more


def _find(process: PlanProcess, package: str, name: str, env: Mapping[str, str]) -> Path | NotFound:
    prefixes = [prefix for prefix in env.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    shares = [Path(prefix) / "share" / package for prefix in prefixes]
    there = [share for share in shares if share.is_dir()]
    for share in there:
        direct = [file for file in (share / name, share / "launch" / name) if file.is_file()]
        found = direct or sorted(share.rglob(name))
        if found:
            return found[0]
    known = sorted({file.name for share in there for kind in _KINDS for file in share.rglob(kind)})
    notes = tuple(f"{share} {'has no ' + name if share in there else 'is not there'}" for share in shares)
    listed = f"it has {', '.join(known[:12])}" if known else f"install the package {package}"
    return NotFound(
        process.name,
        f"launch file {package}/{name}",
        notes or ("AMENT_PREFIX_PATH names no folder",),
        advice=did_you_mean(name, known, listed),
    )
