"""Sections of the robot file that tools add, and the model of a robot file with these sections.

Tools in other packages are looked up only if the file has a key that neither the core nor a
built-in tool knows.
"""

from __future__ import annotations

import inspect
from functools import cache
from typing import TYPE_CHECKING, Any

from pydantic import create_model
from pydantic_core import to_jsonable_python

from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.tool import Key, Problem, Toolset, installed_tools, load, shipped_tools
from tfcompose.spec.language.robot import RobotSpec
from tfcompose.spec.language.spec import key

if TYPE_CHECKING:
    from collections.abc import Collection


def robot_model(names: Collection[str]) -> type[RobotSpec]:
    """Return the model of a robot file, with the sections of the tools that it uses."""
    return _model(_tools_for(names))


def keys_in(names: Collection[str]) -> list[Key]:
    """Return the sections of tools among the sections of a robot file."""
    return [section for name, section in _tools_for(names).keys().items() if name in names]


def data_for_plan(section: Key, value: Any) -> Any:
    """Return a section as JSON data for the plan, None if the plan does not contain it."""
    if section.in_plan:
        return to_jsonable_python(value)
    return None


def problems_with(names: Collection[str]) -> list[Finding]:
    """Return findings about tools in other packages that these sections need."""
    tools = _tools_for(names)
    _, broken = _types(tools)
    return [
        finding(code, message, None, help=help_)
        for code, message, help_ in (*tools.problems, *broken)
    ]


def full_robot_model() -> type[RobotSpec]:
    """Return the model of a robot file with the sections of all installed tools."""
    return _model(installed_tools())


_NO_TOOLS = Toolset(())


def _tools_for(names: Collection[str]) -> Toolset:
    """Return a set of tools that includes those of these sections.

    Installed packages are searched only if necessary.
    """
    unknown = set(names) - RobotSpec.model_fields.keys()
    if not unknown:
        return _NO_TOOLS
    return shipped_tools() if unknown <= shipped_tools().keys().keys() else installed_tools()


@cache
def _model(tools: Toolset) -> type[RobotSpec]:
    types, _ = _types(tools)
    if not types:
        return RobotSpec
    fields = {
        name: (types[name] | None, key(None, section.about, *section.examples))
        for name, section in tools.keys().items()
    }
    model: type[RobotSpec] = create_model(
        "RobotSpec", __base__=RobotSpec, __doc__=RobotSpec.__doc__, __module__=__name__, **fields
    )  # type: ignore[call-overload]
    # Keys of the core come first, because reference and schema follow the order of annotations.
    model.__annotations__ = inspect.get_annotations(RobotSpec) | model.__annotations__
    return model


@cache
def _types(tools: Toolset) -> tuple[dict[str, Any], list[Problem]]:
    """Return the type of each section, and a problem for each model that cannot be loaded.

    Such a section is not validated.
    """
    types: dict[str, Any] = {}
    problems = []
    for name, section in tools.keys().items():
        try:
            types[name] = load(section.model)
        except Exception as error:  # noqa: BLE001 (a foreign package may raise anything)
            types[name] = Any
            message = f"the model of {name} cannot be loaded: {type(error).__name__}: {error}"
            problems.append(
                Problem(
                    "TF921",
                    message,
                    f"update or uninstall the package that provides {section.model}",
                )
            )
    return types, problems
