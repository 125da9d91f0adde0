"""Sections of the robot file that tools bring: the model of a robot file with them.

Tools of other packages are looked up only where a file has a key that neither the core nor a tool
that ships knows.
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
    """Return the model of a robot file with the sections of the tools it uses."""
    return _model(_tools_for(names))


def keys_in(names: Collection[str]) -> list[Key]:
    """Return the sections of tools among those of a robot file."""
    return [section for name, section in _tools_for(names).keys().items() if name in names]


def data_for_plan(section: Key, value: Any) -> Any:
    """Return a section as the plan holds it, as JSON; None where the plan has none of it."""
    if section.in_plan:
        return to_jsonable_python(value)
    return None


def problems_with(names: Collection[str]) -> list[Finding]:
    """Return what is wrong with the foreign tools that these sections need."""
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
    """Return the tools among which those are that know these sections.

    No more than needed are looked up.
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
    # The keys of the core first: the reference and the schema follow the order of annotations.
    model.__annotations__ = inspect.get_annotations(RobotSpec) | model.__annotations__
    return model


@cache
def _types(tools: Toolset) -> tuple[dict[str, Any], list[Problem]]:
    """Return the type of each section, and a problem for each whose model cannot be loaded.

    What such a section says is not checked.
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
