"""What tests of the view share: a server, and a robot file of their own."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import viser

from tests.tools.view.test_view import ROVER
from tfcompose.tools.view.server import started, stop


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    one = started("127.0.0.1", 0, "test")
    yield one
    stop(one)


@pytest.fixture
def rover(tmp_path: Path) -> Path:
    file = tmp_path / ROVER.name
    file.write_bytes(ROVER.read_bytes())
    return file
