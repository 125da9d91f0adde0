"""What tests of the live tree share."""

from collections.abc import Iterator
from typing import Any

import pytest

from tfcompose.ros.environment import FASTDDS_PROFILE


@pytest.fixture
def nodes(domain: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Real nodes that do what a test wants, in the test's domain; they announce themselves as tfcompose's own do."""
    assert domain.id
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(FASTDDS_PROFILE))
    from tests.support.fake_nodes import FakeNodes  # noqa: PLC0415 (ROS, which may not be there)

    nodes = FakeNodes()
    yield nodes
    nodes.close()
