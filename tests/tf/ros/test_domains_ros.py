"""The domains that tests have to themselves."""

import itertools

import pytest

from tests.support import domains
from tests.support.domains import Domain
from tfcompose.tf.ros.node import open_node

pytestmark = pytest.mark.ros


def test_a_domain_in_which_somebody_is_and_one_that_is_locked_are_not_taken(
    domain: Domain, monkeypatch: pytest.MonkeyPatch
) -> None:
    with domains.reserved_domain() as other:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(other))
        stranger = open_node("stranger", "")
        stranger.__enter__()
    try:  # nobody has locked it any more
        assert other in domains.domains_in_use()
        own = domains.own_share(domains.DOMAINS)
        order = itertools.cycle([own.index(domain.id), own.index(other), *range(len(own))])
        monkeypatch.setattr(domains, "_WINDOW", order)
        with domains.reserved_domain() as number:
            assert number not in {domain.id, other}
    finally:
        stranger.__exit__(None, None, None)
