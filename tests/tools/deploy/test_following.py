"""Which changes a robot's launchers can follow while it runs."""

import asyncio

import pytest

from tests.support.deployed import ROBOT, RUNNING, STATE, StandInHost, release_of, rollout_to
from tests.support.plans import compiled_plan
from tfcompose.model.plan.file import write_plan
from tfcompose.tools.deploy.following import can_follow, same_files
from tfcompose.tools.deploy.release import name_of

OTHER = ROBOT.replace("xyz: [0, 0, 1]", "xyz: [0, 0, 2]")


@pytest.mark.parametrize(
    ("before", "after", "can"),
    [
        (ROBOT, OTHER, True),
        (
            ROBOT,
            ROBOT.replace("frames:", "frames:\n  lidar: {parent: base_link, xyz: [0, 0, 1]}"),
            True,
        ),
        (
            ROBOT.replace("frames:", "frames:\n  lidar: {parent: base_link, xyz: [0, 0, 1]}"),
            ROBOT,
            False,
        ),
        (ROBOT, ROBOT.replace("host: jetson", "host: main"), False),
        (ROBOT, ROBOT.replace("robot: rover", "robot: rover\nros: {domain_id: 7}"), False),
        (*(f"{text}guard: {{mode: strict}}\n" for text in (ROBOT, OTHER)), False),
        (*(f"{text}guard: {{on_violation: stop}}\n" for text in (ROBOT, OTHER)), False),
    ],
)
def test_a_robot_goes_on_unless_an_edge_moves_vanishes_or_all_nodes_change(
    before: str, after: str, *, can: bool
) -> None:
    assert can_follow(compiled_plan(before), compiled_plan(after)) is can


def test_who_reads_a_file_that_is_not_built_is_not_known() -> None:
    assert same_files(
        {"plan.json": "a", "files/map.yaml": "b"}, {"plan.json": "c", "files/map.yaml": "b"}
    )
    assert not same_files({"files/map.yaml": "a"}, {"files/map.yaml": "b"})
    assert not same_files({"wheels/one.whl": "a"}, {})


@pytest.mark.parametrize("edited", [False, True])
def test_a_host_whose_launcher_can_follow_is_not_stopped(*, edited: bool) -> None:
    text = write_plan(compiled_plan(ROBOT))

    async def through() -> tuple[StandInHost, StandInHost]:
        hosts = StandInHost("main"), StandInHost("jetson")
        rollout = rollout_to(*hosts)
        await rollout.compare(release_of())
        for share, host in zip(rollout.shares, hosts, strict=True):
            files = share.new_release.manifest | (
                {"plan.json": "edited"} if edited and host.name == "main" else {}
            )
            has = {
                "release": share.goal,
                "files": files,
                "unit": share.unit.text(),
                "robot": RUNNING,
                "failed": False,
            }
            assert name_of(share.new_release.manifest) == share.goal
            host.answers |= {
                "state": STATE | has,
                "texts": {"plan.json": text},
                "follow": "restarted: arm_drive",
            }
            host.requests.clear()
        await rollout.compare(release_of(OTHER))
        await rollout.activate()
        return hosts

    main, jetson = asyncio.run(through())
    assert {"follow", "commit"} <= set(jetson.requests)
    assert not {"stop", "start"} & set(jetson.requests)
    assert ("stop" in main.requests, "follow" in main.requests) == (edited, not edited)
