"""Replacements of modules that launch files import.

The replacement of ``ament_index_python`` also finds packages around the launch file. The
replacements of xacro and MoveIt record the files that they read. The replacement of nav2_common
changes parameter files in memory. A module that is not installed is replaced by a module whose
objects do nothing, and the import reports its name.

This module runs in the process that reads launch files (``launch_process``), with ROS's own
``launch``.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.machinery
import importlib.util
import sys
import types
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ament_index_python.packages
import launch
import launch_ros.substitutions.find_package

from tfcompose.tools.importers.launch_moveit import MoveItConfigsBuilder
from tfcompose.tools.importers.launch_nav2 import (
    HasNodeParams,
    LaunchConfigAsBool,
    ParseMultiRobotPose,
    ReplaceString,
    RewrittenYaml,
)
from tfcompose.tools.importers.launch_objects import here
from tfcompose.tools.importers.launch_records import PACKAGE, FailedError, placeholder

if TYPE_CHECKING:
    from tfcompose.tools.importers.launch_context import RecordingContext


def attach(context: RecordingContext) -> None:
    """Replace the modules for all later imports."""
    _find_in_index(context)
    replaced = _replaced_names(context)
    if importlib.util.find_spec("moveit_configs_utils"):
        del replaced["moveit_configs_utils"]  # if installed, its own code reads the right files
    for name in [name for name in sys.modules if name.partition(".")[0] in replaced]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Replaced(replaced))
    sys.meta_path.append(_NotInstalled(context))


def _find_in_index(context: RecordingContext) -> None:
    """Make ament_index_python also find packages around the launch file.

    For a package that is not found, it returns a ``package://`` address.
    """

    def share(name: str, **_more: Any) -> str:
        return context.find(name, context.file) or f"{PACKAGE}{name}"

    def prefix(name: str) -> str:
        location = context.find(name, context.file)
        return str(Path(location).parents[1]) if location else f"{PACKAGE}{name}"

    index = (ament_index_python, ament_index_python.packages)
    for module in (*index, launch_ros.substitutions.find_package):
        vars(module).update(
            get_package_share_directory=share,
            get_package_prefix=prefix,
            get_package_share_path=lambda name, **_: Path(share(name)),
            get_packages_with_prefixes=dict,
        )


def _replaced_names(context: RecordingContext) -> dict[str, dict[str, Any]]:
    """Return the contents of the replaced modules, by the name of their package."""

    def share(name: str) -> str:
        return ament_index_python.packages.get_package_share_directory(name)

    return {
        "xacro": {
            "process_file": _Document,
            "process": lambda file, **more: _Document(file, **more).text,
            "parse": _Document,
            "process_doc": lambda *_args, **_more: None,
        },
        "nav2_common": {
            "RewrittenYaml": RewrittenYaml,
            "ReplaceString": ReplaceString,
            "HasNodeParams": HasNodeParams,
            "LaunchConfigAsBool": LaunchConfigAsBool,
            "ParseMultiRobotPose": functools.partial(ParseMultiRobotPose, context),
        },
        "moveit_configs_utils": {
            "MoveItConfigsBuilder": functools.partial(MoveItConfigsBuilder, share, context)
        },
    }


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """An importer that creates replacement modules."""

    def exec_module(self, module: Any) -> None:
        """Do nothing: the module is complete."""


class _Replaced(_Finder):
    """Finds replaced modules. It comes before the finders of installed modules."""

    def __init__(self, replaced: dict[str, dict[str, Any]]) -> None:
        self._replaced = replaced

    def find_spec(self, fullname: str, _path: Any = None, _target: Any = None) -> Any:
        if fullname.partition(".")[0] not in self._replaced:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: Any) -> Any:
        module = _Module(spec.name)
        vars(module).update(self._replaced[spec.name.partition(".")[0]])
        return module


class _NotInstalled(_Finder):
    """Creates modules that launch files import and that are not installed.

    It comes after all other finders.
    """

    def __init__(self, context: RecordingContext) -> None:
        self._context = context

    def find_spec(self, fullname: str, _path: Any = None, _target: Any = None) -> Any:
        if not _is_from_launch_file():
            return None
        return importlib.machinery.ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: Any) -> Any:
        self._context.todo(here(), f"the module {spec.name} is not installed")
        return _Module(spec.name)


def _is_from_launch_file() -> bool:
    """Return whether a launch file itself imports the module."""
    frame: Any = sys._getframe(2)  # noqa: SLF001 (CPython's only way)
    while frame is not None:
        name = frame.f_code.co_filename
        if not name.startswith("<frozen") and name != __file__ and "importlib" not in name:
            return bool(frame.f_globals.get("__name__") == "python_launch_file")
        frame = frame.f_back
    return False


class _Module(types.ModuleType):
    """A module that contains the given names, and creates any other name on demand."""

    __path__: list[str] = []  # noqa: RUF012 (as a package has it)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        qualified = f"{self.__name__}.{name}"
        if name[:1].isupper():
            stand_in: Any = type(name, (_Unknown,), {"NAME": qualified})
        else:
            stand_in = _Unknown()
            stand_in.NAME = qualified
        setattr(self, name, stand_in)
        return stand_in


class _Unknown(launch.Action, launch.Substitution):  # type: ignore[misc]
    """An action, substitution or value from a module that is not installed.

    Every operation on the object returns such an object.
    """

    NAME = ""

    def __init__(self, *_args: Any, **_kwargs: Any) -> None:
        launch.Action.__init__(self)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        unknown = _Unknown()
        unknown.NAME = f"{self.NAME}.{name}"
        return unknown

    def __call__(self, *_args: Any, **_kwargs: Any) -> Any:
        return self

    def __getitem__(self, key: Any) -> Any:
        return self

    def __iter__(self) -> Any:
        return iter(())

    def __len__(self) -> int:
        return 0

    def __str__(self) -> str:
        return ""

    def execute(self, _context: Any) -> None:
        raise FailedError(f"{self.NAME} is not known here")

    def perform(self, _context: Any) -> str:
        raise FailedError(f"{self.NAME} is not known here")

    def describe(self) -> str:
        return self.NAME


class _Document:
    """The result of xacro for a file."""

    def __init__(self, file: Any, mappings: Any = None) -> None:
        args = {str(name): str(value) for name, value in dict(mappings or {}).items()}
        self.text = placeholder(str(file), args)

    def toxml(self, *_args: Any, **_kwargs: Any) -> str:
        return self.text

    toprettyxml = toxml
