"""Client of the confined process that reads launch files, and the schema of its answer."""

from __future__ import annotations

import os
import signal
import tempfile
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.foundation import confined
from tfcompose.foundation.confined import Outcome, run_confined
from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.reach import Reach
from tfcompose.foundation.shape import fits
from tfcompose.model.process_keys import EXTRA_ARGUMENTS, KeywordKind, launch_keywords
from tfcompose.tools.importers.texts import SHAPE as TEXT
from tfcompose.tools.importers.texts import from_json

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

#: The module that runs in the confined process and reads launch files.
PROCESS = "tfcompose.tools.importers.launch_process"
#: The maximum number of characters in the message of a launch file that stopped.
_LONGEST = 4000
#: The maximum of a time in seconds, or of a number of attempts.
_LARGEST = 1e9


@dataclass(frozen=True, slots=True)
class Launch:
    """A launch file to read."""

    file: str
    text: str
    #: Launch arguments.
    arguments: Mapping[str, str] = field(default_factory=dict)
    #: Folders of packages that are not installed.
    packages: Mapping[str, str] = field(default_factory=dict)
    #: The entries of AMENT_PREFIX_PATH.
    prefixes: tuple[str, ...] = ()
    #: Whether to ignore conditions.
    every_branch: bool = False
    #: The file's name in findings; empty: ``file``.
    display_name: str = ""
    #: Whether to run the file without the sandbox.
    is_trusted: bool = False
    print_output: Callable[[str, str], None] = lambda _file, _text: None
    report_missing: Callable[[tuple[str, ...]], None] = lambda _: None

    def span(self, line: int = 1) -> Span:
        """Return the span of a line of the file."""
        return Span(self.display_name or self.file, max(line, 1))


def has_launch() -> bool:
    """Return whether ROS's launch can be imported.

    A folder named launch, which is common next to launch files, does not count.
    """
    specs = [find_spec(name) for name in ("launch", "launch_ros", "launch_xml", "launch_yaml")]
    return all(spec is not None and spec.origin is not None for spec in specs)


def reach_of(launch: Launch) -> Reach:
    """Return the files that a launch file may read."""
    reach = Reach(everything=launch.is_trusted)
    reach.add_tree(launch.file)
    reach.add_neighbours(launch.file)
    for folder in launch.packages.values():
        reach.add_folder(folder)
    for prefix in launch.prefixes:
        reach.add_prefix(prefix)
    reach.add_libraries()
    return reach


def answer_of(launch: Launch, reach: Reach, reader: str) -> dict[str, Any]:
    """Run the confined process, and return the records of a launch file and remarks about it.

    ``reader`` is ``launch`` for ROS's own launch, or ``xml`` for launch files of ROS 1.

    Raises:
        RejectedError: if the process ends without an answer.
    """
    trusted = launch.is_trusted
    wall_s = confined.MOST_TRUSTED_WALL_S if trusted else confined.MOST_WALL_S
    request = {
        "file": str(Path(launch.file).absolute()),
        "arguments": dict(launch.arguments),
        "packages": {
            name: str(Path(folder).absolute()) for name, folder in launch.packages.items()
        },
        "prefixes": list(launch.prefixes),
        "every_branch": launch.every_branch,
        "reader": reader,
        "readable": None if trusted else reach.grants(),
        "temporary": tempfile.gettempdir(),
        "wall_s": wall_s,
    }
    outcome = run_confined(
        PROCESS,
        request,
        {},
        wall_s=wall_s,
        environment={
            **os.environ,
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONHASHSEED": "0",
        },  # the order of a set is the same in each run
    )
    launch.print_output(launch.display_name or launch.file, outcome.printed)
    launch.report_missing(outcome.missing)
    answer = outcome.answer
    if fits(answer, _ANSWER) and all(map(_is_record, answer["records"])):
        records = list(map(_with_texts, answer["records"]))
        return {**answer, "records": records, "stopped": answer["stopped"][:_LONGEST]}
    raise RejectedError(
        [finding("TF008", f"the launch file {_describe_end(outcome)}", launch.span())]
    )


_NUMBER, _OPTIONAL = (int, float), (str, None)
_SCALAR = (*TEXT, bool, int, float, None)
_PARAMETERS = [(str, {"*": (*_SCALAR, [_SCALAR])})]
_TEXTS = {"*": TEXT}
_AT: dict[str, Any] = {"at": [(str, int)], "when?": [str], "only_when?": str}
_KINDS: dict[KeywordKind, Any] = {
    "text": str,
    "switch": bool,
    "number": _NUMBER,
    "output": (str, [str]),
    "shutdown": bool,
    "parameters": _PARAMETERS,
}
_COMMON = _AT | {
    "id": (str, int),
    "env": _TEXTS,
    "period": _NUMBER,
    "after": {"*": str},
    "shell?": bool,
    "only_env?": bool,
    **{f"{keyword.name}?": _KINDS[keyword.kind] for keyword in launch_keywords(*_KINDS)},
}
_OF_NODE = {
    "package": _OPTIONAL,
    "name": _OPTIONAL,
    "namespace": _OPTIONAL,
    "params": _PARAMETERS,
    "common?": int,
    "remap": [[TEXT]],
}
_NODE = (
    _COMMON
    | _OF_NODE
    | {
        "executable": str,
        "label": _OPTIONAL,
        "argv": [TEXT],
        "lifecycle?": _OPTIONAL,
        "ros1?": bool,
    }
)
#: The schema of the answer, by kind of record.
_RECORDS: dict[str, Any] = {
    "node": _NODE,
    "container": _NODE,
    "process": _COMMON
    | {"argv": [TEXT], "label": _OPTIONAL, "package?": _OPTIONAL, "executable?": str},
    "component": _AT
    | _OF_NODE
    | {
        "id": (str, int),
        "container": _OPTIONAL,
        "plugin": str,
        "period": _NUMBER,
        "after": {"*": str},
        f"{EXTRA_ARGUMENTS.name}?": _PARAMETERS,
    },
    "include": _AT
    | {
        "file": str,
        "args": _TEXTS,
        "namespace": _OPTIONAL,
        "env": _TEXTS,
        "period": _NUMBER,
        "after": {"*": str},
    },
    "argument": _AT
    | {
        "name": str,
        "default": Any,
        "value": str,
        "choices": [str],
        "description": str,
        "variable": str,
    },
    "lifecycle": _AT | {"node": (str, int), "state": str},
    "required": _AT | {"node": (str, int)},
    "package": _AT | {"name": str},
    "file": _AT | {"path": str},
    "skipped": _AT | {"text": str},
    "todo": _AT | {"text": str},
}
_ANSWER = {
    "records": [{"kind": str}],
    "stopped": str,
    "line": int,
    "decided": [str],
    "files": {"*": str},
}
_PAIR = 2


def _is_record(record: dict[str, Any]) -> bool:
    """Return whether a record fits the schema of its kind.

    The launch file may have manipulated the process that sent it.
    """
    counts = [record.get(keyword.name, 0) for keyword in launch_keywords("number")]
    place = record.get("at")
    return (
        fits(record, _RECORDS.get(record["kind"]))
        and (place == [] or [type(part) for part in place or ()] == [str, int])
        and all(len(rule) == _PAIR for rule in record.get("remap", ()))
        and abs(record.get("period", 0)) <= _LARGEST
        and all(isinstance(value, float) or abs(value) <= _LARGEST for value in counts)
    )


def _with_texts(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record in which ``Text`` objects replace their JSON form."""
    texts: dict[str, Callable[[Any], Any]] = {
        "argv": lambda argv: list(map(from_json, argv)),
        "remap": lambda rules: [list(map(from_json, rule)) for rule in rules],
        "env": _values_with_texts,
        "args": _values_with_texts,
        "params": _params_with_texts,
        EXTRA_ARGUMENTS.name: _params_with_texts,
    }
    values = {name: read(record[name]) for name, read in texts.items() if name in record}
    return record | values


def _params_with_texts(params: list[Any]) -> list[Any]:
    """Return parameters in which ``Text`` objects replace their JSON form."""
    return list(map(_values_with_texts, params))


def _values_with_texts(values: Any) -> Any:
    if not isinstance(values, dict):
        return values
    return {name: _value_with_texts(value) for name, value in values.items()}


def _value_with_texts(value: Any) -> Any:
    return list(map(from_json, value)) if isinstance(value, list) else from_json(value)


def _describe_end(outcome: Outcome) -> str:
    """Describe the end of a process that sent no answer."""
    if outcome.timed_out:
        return f"takes more than {confined.MOST_WALL_S:g} s"
    if outcome.refused:
        return f"was ended: {outcome.refused}"
    if outcome.answer is not None:
        return "was ended: its answer is invalid"
    if outcome.code >= 0:
        return f"ends the process that reads it, with code {outcome.code}"
    return _describe_signal(-outcome.code)


def _describe_signal(number: int) -> str:
    """Describe why a signal ended the process that read a launch file."""
    if number == signal.SIGXCPU:
        return "takes too long"
    if number == signal.SIGKILL:
        return "was killed, perhaps because it needed too much memory"
    name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
    return f"was ended by {name}, from its own code or from a module that it loads"
