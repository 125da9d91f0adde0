"""Robots that are only texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError, Span, finding

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.compiler.compile import Compiled
    from tfcompose.model.robot import Robot


def reader(texts: Mapping[str, str]) -> Callable[[str], str]:
    """Return what reads these texts by their names, and no other."""

    def read(name: str) -> str:
        if name not in texts:
            raise RejectedError([finding("TF001", "cannot be read: no such file", Span(name))])
        return texts[name]

    return read


def robot_in(compiled: Compiled) -> Robot:
    """Return the robot that was compiled without errors."""
    assert not compiled.errors, compiled.errors
    assert compiled.robot
    return compiled.robot
