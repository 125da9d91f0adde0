"""What the histories of the guard begin with."""

from __future__ import annotations

import pytest

from tests.run.watched import History


@pytest.fixture
def history() -> History:
    """The guard has begun to look."""
    return History()


@pytest.fixture
def running() -> History:
    """The plan has been started."""
    return History().clear()
