"""Replacement of nav2_common's substitutions, which keeps their parameter files in memory.

This runs in the process that reads launch files (``launch_process``), with ROS's own ``launch``.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import launch
import yaml
from launch.substitutions import LaunchConfiguration

from tfcompose.tools.importers.launch_objects import here
from tfcompose.tools.importers.launch_parameters import file_of_text, text_of
from tfcompose.tools.importers.launch_records import PACKAGE, FailedError, file_text, with_package

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tfcompose.tools.importers.launch_context import RecordingContext

_TRUE = frozenset({"true", "1", "yes", "on", "y", "t"})


class LaunchConfigAsBool(LaunchConfiguration):  # type: ignore[misc]
    """The value of a launch argument as True or False, for any spelling of it."""

    def __init__(self, name: Any) -> None:
        super().__init__(name)

    def perform(self, context: Any) -> str:
        """Return ``True`` or ``False``."""
        return str(super().perform(context).strip().lower() in _TRUE)


class _FromFile(launch.Substitution):  # type: ignore[misc]
    """Base class of substitutions that read a parameter file."""

    def __init__(self, source_file: Any) -> None:
        super().__init__()
        self.place, self.source_file = here(), source_file

    def file(self, context: RecordingContext) -> str:
        """Return the path of the file, or a ``package://`` address if its package is not found."""
        return with_package(text_of(self.source_file, context))

    def write_changed(
        self, context: RecordingContext, changes: Mapping[str, str], change: Callable[[str], str]
    ) -> str:
        """Store the changed file, and return its placeholder path.

        If the file's package is not found, report the changes instead.
        """
        file = self.file(context)
        if not changes:
            return file
        if file.startswith(PACKAGE):
            texts = ", ".join(f"{key}: {value}" for key, value in changes.items())
            context.todo(self.place, f"changes in {Path(file).name}: {texts}")
            return file
        source = file_text(file)
        return file_of_text(file, source, change(source), self.place, context)


def _texts(values: Mapping[str, Any] | None, context: RecordingContext) -> dict[str, str]:
    items = values.items() if values else ()
    return {text_of(key, context): text_of(value, context) for key, value in items}


class ReplaceString(_FromFile):
    """A copy of a file in which texts are replaced."""

    def __init__(
        self, source_file: Any, replacements: Mapping[str, Any], condition: Any = None
    ) -> None:
        super().__init__(source_file)
        self.replacements, self.condition = replacements, condition

    def perform(self, context: Any) -> str:
        """Return the path of the changed file."""
        if self.condition is not None and not self.condition.evaluate(context):
            return self.file(context)
        texts = _texts(self.replacements, context)

        def replaced(source: str) -> str:
            for old, new in texts.items():
                source = source.replace(old, new)
            return source

        return self.write_changed(context, texts, replaced)


class RewrittenYaml(_FromFile):
    """A copy of a parameter file with changed values or keys, or with an added namespace.

    A rewrite applies to a key at any depth, or to a path of keys separated by dots.
    """

    def __init__(
        self, source_file: Any, param_rewrites: Mapping[str, Any], root_key: Any = "", **more: Any
    ) -> None:
        super().__init__(source_file)
        self.rewrites = (param_rewrites, more.get("key_rewrites"), more.get("value_rewrites"))
        self.root_key, self.convert_types = root_key, more.get("convert_types", False)

    def perform(self, context: Any) -> str:
        """Return the path of the changed file."""
        params, keys, values = (_texts(rewrites, context) for rewrites in self.rewrites)
        root = text_of(self.root_key or "", context)
        below = {"all of it below": root} if root else {}

        def rewritten(source: str) -> str:
            data = _mapping_in(source, self.file(context))
            self._set_keys(data, params)
            self._set_paths(data, params)
            data = self._with_values(_with_keys(data, keys), values)
            return yaml.safe_dump({root: data} if root else data)

        return self.write_changed(context, {**params, **keys, **values, **below}, rewritten)

    def _set_keys(self, data: Any, params: Mapping[str, str]) -> None:
        if not isinstance(data, dict):
            return
        for key, value in data.items():
            self._set_keys(value, params)
            if key in params:
                data[key] = self._convert(params[key])

    def _set_paths(self, data: Any, params: Mapping[str, str]) -> None:
        """Set values by their paths; add a missing path to the parameters of its node."""
        existing = set(_paths(data, ()))
        for path, value in params.items():
            keys = path.split(".")
            if path in existing or "ros__parameters" in keys:
                _set(data, keys, self._convert(value))

    def _with_values(self, data: Any, values: Mapping[str, str]) -> Any:
        if isinstance(data, dict):
            return {key: self._with_values(value, values) for key, value in data.items()}
        if isinstance(data, list):
            return [self._with_values(value, values) for value in data]
        return self._convert(values[str(data)]) if str(data) in values else data

    def _convert(self, text: str) -> Any:
        """Return the value of a rewrite.

        The texts true and false become bools, and numbers become numbers if the launch file asks
        for conversion.
        """
        if self.convert_types:
            try:
                return float(text) if "." in text else int(text)
            except ValueError:
                pass
        return {"true": True, "false": False}.get(text.lower(), text)


def _mapping_in(text: str, file: str) -> Any:
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FailedError(f"{file} is not YAML: {error}") from None
    if not isinstance(data, dict):
        raise FailedError(f"{file} has no parameters")
    return data


def _with_keys(data: Any, keys: Mapping[str, str]) -> Any:
    if not isinstance(data, dict):
        return data
    return {keys.get(key, key): _with_keys(value, keys) for key, value in data.items()}


def _paths(data: Any, above: tuple[str, ...]) -> Iterator[str]:
    """Yield the paths of all values, with dots between the keys."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _paths(value, (*above, str(key)))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _paths(value, (*above, str(index)))
    else:
        yield ".".join(above)


def _set(data: Any, keys: list[str], value: Any) -> None:
    """Set the value at a path of keys and list indices; create missing mappings."""
    *above, last = keys
    for key in above:
        data = data[int(key)] if isinstance(data, list) else data.setdefault(key, {})
    data[int(last) if isinstance(data, list) else last] = value


class HasNodeParams(_FromFile):
    """A substitution that is True if a parameter file has a section for a node."""

    def __init__(self, source_file: Any, node_name: str) -> None:
        super().__init__(source_file)
        self.node_name = node_name

    def perform(self, context: Any) -> str:
        """Return ``True`` or ``False``."""
        data = yaml.safe_load(file_text(self.file(context)))
        return str(isinstance(data, dict) and self.node_name in data)


class ParseMultiRobotPose:
    """Poses of robots that nav2_common reads from the command line of ``ros2 launch``."""

    def __init__(self, context: RecordingContext, argument: str) -> None:
        context.todo(
            here(),
            f"the argument {argument}, which ParseMultiRobotPose takes from the command line",
        )

    def value(self) -> dict[str, Any]:
        """Return an empty mapping, because an import has no such command line."""
        return {}
