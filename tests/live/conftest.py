"""What tests of the live tree share."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def nodes(domain: Any) -> Iterator[Any]:
    """Real nodes that do what a test wants, in the test's domain."""
    assert domain.id
    from tests.support.fake_nodes import FakeNodes  # noqa: PLC0415 (ROS, which may not be there)

    nodes = FakeNodes()
    yield nodes
    nodes.close()
