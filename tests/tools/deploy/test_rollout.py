"""What a deployment decides, with hosts that answer as the test has them answer."""

import asyncio
from typing import Any

import pytest

from tests.support.deployed import (
    NOWHERE,
    ROBOT,
    RUNNING,
    STATE,
    STATUS,
    StandInHost,
    release_of,
    rollout_to,
)
from tests.support.findings import expect
from tests.support.plans import compiled_plan
from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.tools.deploy.connection import LostError, RefusedError
from tfcompose.tools.deploy.rollout import Rollout, target_of


def examined(*hosts: StandInHost, **options: Any) -> list[Finding]:
    return asyncio.run(rollout_to(*hosts, **options).examine())


def released(*hosts: StandInHost) -> Rollout:
    async def through() -> Rollout:
        rollout = rollout_to(*hosts)
        await rollout.lock()
        await rollout.compare(release_of())
        await rollout.send()
        await rollout.activate()
        return rollout

    return asyncio.run(through())


def rejected(*hosts: StandInHost) -> tuple[Finding, ...]:
    with pytest.raises(RejectedError) as refused:
        released(*hosts)
    return refused.value.findings


def test_a_robot_without_hosts_or_with_a_process_on_none_is_not_deployed() -> None:
    hostless = ROBOT.replace("hosts: {main: {}, jetson: {ssh: pi@10.0.0.3}}\n", "")
    for text, code, name in ((hostless, "TF912", "rover"), (NOWHERE, "TF912", "drive")):
        with pytest.raises(RejectedError) as refused:
            target_of(compiled_plan(text), [], {})
        expect(refused.value.findings[0], code, name)
    with pytest.raises(RejectedError) as refused:
        target_of(compiled_plan(ROBOT), ["jetsn"], {})
    expect(refused.value.findings[0], "TF819", "jetsn", "jetson")


def test_all_hosts_stop_before_any_starts_and_keep_a_live_release() -> None:
    order: list[str] = []
    main, jetson = StandInHost("main", requests=order), StandInHost("jetson", requests=order)
    released(main, jetson)
    for before, after in (
        ("take_lock", "unpack"),
        ("rehearse", "stop"),
        ("stop", "start"),
        ("wait", "commit"),
    ):
        last = max(index for index, request in enumerate(order) if request == before)
        assert last < order.index(after), (before, after)
    assert order[-2:] == ["settle", "settle"]


def test_a_host_that_runs_the_release_goes_on() -> None:
    async def through() -> tuple[StandInHost, StandInHost, dict[str, list[str]]]:
        main, jetson = StandInHost("main"), StandInHost("jetson")
        rollout = rollout_to(main, jetson)
        await rollout.compare(release_of())
        share = rollout.shares[0]
        same = {
            "release": share.goal,
            "files": share.new_release.manifest,
            "unit": share.unit.text(),
        }
        main.answers["state"] = STATE | STATUS | same
        await rollout.compare(release_of())
        changes = rollout.changes()
        await rollout.send()
        await rollout.activate()
        return main, jetson, changes

    main, jetson, changes = asyncio.run(through())
    assert list(changes) == ["jetson"]
    assert not {"unpack", "stop", "start", "commit"} & set(main.requests)
    assert {"unpack", "stop", "start", "commit"} <= set(jetson.requests)


@pytest.mark.parametrize(
    ("request_", "answer", "says"),
    [
        ("stop", LostError("lost its connection"), "jetson lost"),
        ("start", RefusedError("systemctl start: no"), "systemctl start: no"),
        ("wait", {"robot": None, "failed": True, "lines": ["error: x"]}, "keeps exiting"),
        (
            "wait",
            STATUS | {"robot": RUNNING | {"missing": ["base_link → arm"]}},
            "base_link → arm",
        ),
        ("commit", RefusedError("No space left"), "No space left"),
    ],
)
def test_whatever_fails_on_one_host_takes_all_back(request_: str, answer: Any, says: str) -> None:
    main, jetson = StandInHost("main"), StandInHost("jetson", {request_: answer})
    findings = rejected(main, jetson)
    expect(findings[0], "TF917", says, "main returned to release before")
    assert main.requests[-1] == jetson.requests[-1] == "back"


def test_what_cannot_be_started_is_found_before_anything_stops() -> None:
    wrong = {"code": "TF810", "message": "drive: no program x", "help": "install it"}
    main, jetson = StandInHost("main"), StandInHost("jetson", {"rehearse": [wrong]})
    expect(rejected(main, jetson)[0], "TF810", "jetson: drive: no program x", "install it")
    assert main.requests[-1] == jetson.requests[-1] == "discard"


def test_a_lock_that_somebody_holds_ends_it() -> None:
    held = StandInHost("jetson", {"take_lock": {"holder": "ann@laptop, pid 7, since 12:00:00"}})
    expect(rejected(StandInHost("main"), held)[0], "TF915", "jetson", "ann@laptop, pid 7")


def test_hosts_that_are_unfit_or_apart_are_found() -> None:
    pair = StandInHost("main"), StandInHost("jetson")
    assert not examined(*pair)
    expect(
        examined(*pair, probes={"jetson": {"tfcompose": None}})[0], "TF914", "jetson", "--wheels"
    )
    expect(
        examined(*pair, probes={"jetson": {"problems": ["no systemd"]}})[0],
        "TF914",
        "jetson",
        "no systemd",
    )
    for variable in ("ROS_DOMAIN_ID", "RMW_IMPLEMENTATION"):
        expect(
            examined(*pair, probes={"jetson": {"env": {variable: "7"}}})[0],
            "TF916",
            variable,
            "7 on jetson",
        )
    elsewhere = {"main": {"machine": "b"}}
    assert not examined(*pair, probes=elsewhere)
    apart = ROBOT.replace("robot: rover", "robot: rover\nros: {discovery: localhost}")
    expect(examined(*pair, text=apart, probes=elsewhere)[0], "TF916", "localhost", "subnet")
    assert not examined(*pair, text=apart), "hosts of one computer"
    expect(
        examined(StandInHost("main"), StandInHost("jetson", offset_s=-2))[0],
        "TF834",
        "2 s",
        "main",
        "jetson",
    )
    assert not examined(StandInHost("main"), StandInHost("jetson", offset_s=0.05))


def test_a_robot_that_was_started_by_hand_is_found() -> None:
    host = StandInHost("main", {"state": STATE | STATUS | {"stranger": 4711}})
    rollout = rollout_to(host)
    asyncio.run(rollout.compare(release_of()))
    expect(rollout.strangers()[0], "TF914", "4711", "tfcompose down --robot rover.main")


def test_without_a_release_before_there_is_no_return() -> None:
    with pytest.raises(RejectedError) as refused:
        asyncio.run(rollout_to(StandInHost("main")).plan_return())
    expect(refused.value.findings[0], "TF912", "main")
