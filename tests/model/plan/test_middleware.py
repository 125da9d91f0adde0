"""What a plan's processes need for the middleware that it names."""

import re

import pytest

from tfcompose.model.plan import RosSettings
from tfcompose.model.plan.middleware import (
    ENDPOINT,
    ZENOH_OVERRIDE,
    middleware_variables,
    router_variables,
)


def test_a_plan_without_a_middleware_says_nothing_of_one() -> None:
    assert middleware_variables(RosSettings(discovery="localhost"), {}) == {}
    assert middleware_variables(RosSettings(router="tcp/a:7447"), {}) == {}


def test_cyclone_takes_over_33_processes_per_computer_unless_configured() -> None:
    ros = RosSettings(rmw="cyclonedds", discovery="localhost")
    variables = middleware_variables(ros, {})
    assert variables["RMW_IMPLEMENTATION"] == "rmw_cyclonedds_cpp"
    assert "<MaxAutoParticipantIndex>119<" in variables["CYCLONEDDS_URI"]
    assert variables == middleware_variables(
        RosSettings(rmw="cyclonedds"), {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    )
    assert "CYCLONEDDS_URI" not in middleware_variables(
        RosSettings(rmw="cyclonedds", discovery="subnet"), {}
    )
    assert "CYCLONEDDS_URI" not in middleware_variables(
        ros, {"CYCLONEDDS_URI": "file:///etc/cyclone.xml"}
    )


def test_sessions_are_clients_of_a_named_router_and_else_zenohs_default() -> None:
    assert middleware_variables(RosSettings(rmw="zenoh"), {}) == {
        "RMW_IMPLEMENTATION": "rmw_zenoh_cpp"
    }
    ros = RosSettings(rmw="zenoh", router="tcp/10.0.0.2:7448")
    assert (
        middleware_variables(ros, {})[ZENOH_OVERRIDE]
        == 'mode="client";connect/endpoints=["tcp/10.0.0.2:7448"]'
    )
    for name in (ZENOH_OVERRIDE, "ZENOH_SESSION_CONFIG_URI"):
        assert ZENOH_OVERRIDE not in middleware_variables(ros, {name: "of the user"})


@pytest.mark.parametrize(
    ("router", "discovery", "listens"),
    [
        (None, None, None),
        (None, "subnet", None),
        (None, "localhost", "tcp/localhost:7447"),
        ("tcp/10.0.0.2:7448", None, "tcp/[::]:7448"),
        ("tls/[fe80::1]:7449", "subnet", "tls/[::]:7449"),
        ("tcp/localhost:7450", "localhost", "tcp/localhost:7450"),
    ],
)
def test_the_router_listens_where_sessions_expect_it(
    router: str | None, discovery: str | None, listens: str | None
) -> None:
    ros = RosSettings(rmw="zenoh", router=router, discovery=discovery)  # type: ignore[arg-type]
    expected = {} if listens is None else {ZENOH_OVERRIDE: f'listen/endpoints=["{listens}"]'}
    assert router_variables(ros) == expected


def test_an_endpoint_has_a_protocol_an_address_and_a_port() -> None:
    assert all(
        re.fullmatch(ENDPOINT, text)
        for text in ("tcp/10.0.0.2:7447", "tls/brain.local:1", "quic/[::1]:7447")
    )
    assert not any(
        re.fullmatch(ENDPOINT, text)
        for text in ("10.0.0.2:7447", "tcp/10.0.0.2", 'tcp/a:1"]', "tcp/a b:1")
    )
