"""What tests of the view share: a server, and a robot file of their own."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import viser

from tests.support.browser import TOKEN
from tests.tools.view.test_view import ROVER
from tfcompose.tools.view.server import start_server, stop_server


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_server("127.0.0.1", 0, "test", TOKEN)
    yield started
    stop_server(started)


@pytest.fixture
def rover(tmp_path: Path) -> Path:
    file = tmp_path / ROVER.name
    file.write_bytes(ROVER.read_bytes())
    return file
