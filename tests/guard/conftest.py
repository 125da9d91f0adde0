"""What tests of the guard begin with."""

import pytest

from tests.support.guard_history import History


@pytest.fixture
def history() -> History:
    """The guard has begun to look."""
    return History()


@pytest.fixture
def running() -> History:
    """The plan has been started."""
    return History().clear()
