"""The launcher's children when no descriptor is free."""

import os
import resource
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from selectors import DefaultSelector
from typing import Any

import pytest

from tfcompose.foundation import procfs
from tfcompose.launcher.child import ChildCommand
from tfcompose.launcher.children import Children, GuardPipes
from tfcompose.model.plan import PlanProcess


@contextmanager
def spare_descriptors(count: int) -> Iterator[None]:
    """Let this process open that many descriptors more, and check that none of them stays open."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    before = sorted(procfs.descriptors())
    free = os.dup(0)
    os.close(free)
    resource.setrlimit(resource.RLIMIT_NOFILE, (free + count, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert sorted(procfs.descriptors()) == before


@pytest.mark.parametrize(
    ("count", "memory"), [(0, {}), (2, {}), (4, {"live": ["base_link"]})], ids=str
)
def test_pipes_of_a_guard_that_cannot_all_be_opened_are_closed(
    count: int, memory: dict[str, Any]
) -> None:
    with spare_descriptors(count), pytest.raises(OSError, match="Too many open files"):
        GuardPipes(joins=False, memory=memory)


def test_a_process_that_cannot_be_prepared_leaves_the_reason_to_its_start(tmp_path: Path) -> None:
    command = ChildCommand(("true",), dict(os.environ), tmp_path, is_built_in=True)
    with DefaultSelector() as selector, ExitStack() as ending:
        children = Children(selector, "", lambda _: None, lambda _: None, lambda name, _: name)
        ending.callback(children.close)
        with spare_descriptors(0):
            children.prepare(PlanProcess("static", "static"), command)
