"""What tests of the live tree share."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest

from tfcompose.ros.environment import FASTDDS_PROFILE

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def stage(domain: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A stage for real nodes, in the test's domain; they announce themselves as tfcompose's own do."""
    assert domain.id
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(FASTDDS_PROFILE))
    stage = import_module("tests.observe.stage").Stage()  # ROS, which may not be there
    yield stage
    stage.close()
