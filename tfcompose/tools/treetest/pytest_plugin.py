"""Plug-in for pytest: collects the cases of test files, and has the fixture ``tfcompose``.

pytest loads it in every session. Everything that costs time is imported when a test file is
collected or the fixture is used.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tfcompose.tools.treetest import ENDINGS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tfcompose.tools.treetest.started_robot import RobotStarter

#: Keys of every test file. In a folder, files of other programs may have the same ending.
_KEYS = (re.compile(rb"^robot\s*:", re.MULTILINE), re.compile(rb"^cases\s*:", re.MULTILINE))


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of ``tfcompose test`` that pytest does not have."""
    group = parser.getgroup("tfcompose", "transform trees of robots")
    group.addoption(
        "--tfcompose-trust",
        action="store_true",
        help="run your own xacro files without the sandbox",
    )
    group.addoption(
        "--tfcompose-keep",
        metavar="FOLDER",
        help="leave a bag, a picture and the logs of each failed case in FOLDER",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a test file."""
    if not file_path.name.endswith(ENDINGS):
        return None
    if not parent.session.isinitpath(file_path) and not _is_test_file(file_path):
        return None
    from tfcompose.tools.treetest.pytest_cases import CaseFile  # noqa: PLC0415 (loads pydantic)

    return CaseFile.from_parent(parent, path=file_path)


def _is_test_file(path: Path) -> bool:
    data = path.read_bytes()
    return all(key.search(data) for key in _KEYS)


@pytest.fixture
def tfcompose(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RobotStarter]:
    """Start robots in a ROS domain of the test's own: ``tfcompose.up("rover.yaml")``.

    Files are relative to the test's folder. Nodes and processes that the test starts are in the
    same domain.
    """
    from tfcompose.tools.treetest import started_robot  # noqa: PLC0415 (few sessions need it)

    folder = tmp_path_factory.mktemp("tfcompose")
    with (
        started_robot.enter_domain(folder),
        started_robot.RobotStarter(request.path.parent, folder) as starter,
    ):
        yield starter
