"""What tests of the launcher begin with."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.launcher import Launcher, launched
from tfcompose.model.plan import PlanProcess


@pytest.fixture
def launch(tmp_path: Path) -> Iterator[Callable[..., Launcher]]:
    """Start a launcher of these processes in a folder of the test's own."""
    launchers: list[Launcher] = []

    def start(*planned: PlanProcess) -> Launcher:
        launchers.append(launched(tmp_path, *planned))
        return launchers[-1]

    yield start
    for launcher in launchers:
        launcher.kill()
