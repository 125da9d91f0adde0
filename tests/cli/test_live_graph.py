"""The published tree as a picture.

Each edge with its publisher, second parents too, and what has no pose.
"""

from typing import Any

import pytest

from tfcompose.cli import main
from tfcompose.cli.tree_picture import graph_of_observers
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import Plan, PlanEdge, RosSettings, SourceLine
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher

SECOND = 1_000_000_000


def row(
    parent: str, child: str, second: int, x: float = 0.0, w: float = 1.0
) -> tuple[object, ...]:
    return (parent, child, second, 0, x, 0.0, 0.0, 0.0, 0.0, 0.0, w)


@pytest.fixture
def observer() -> TreeObserver:
    observed = TreeObserver()
    observed.take_graph(
        [Publisher(b"1", "/drive", static=False), Publisher(b"2", "/static", static=True)]
    )
    for second in range(1, 5):
        rows: list[Any] = [row("odom", "base", second)]
        observed.take(rows, static=False, gid=b"1", received_ns=second * SECOND)
    lidar: Any = row("base", "lidar", 1, 0.25)
    observed.take([lidar], static=True, gid=b"2", received_ns=4 * SECOND)
    lidar = row("mast", "lidar", 1, 0.5, 0.0)
    observed.take([lidar], static=True, gid=b"3", received_ns=4 * SECOND)
    return observed


def test_each_edge_has_its_publisher_its_kind_and_its_rate(observer: TreeObserver) -> None:
    arrows = {
        (arrow.parent, arrow.child): arrow
        for arrow in graph_of_observers([observer], "/tf").arrows
    }
    assert len(arrows) == 3
    moving, fixed, second = (
        arrows["odom", "base"],
        arrows["base", "lidar"],
        arrows["mast", "lidar"],
    )
    assert (moving.owner, moving.kind, moving.detail, moving.pose) == (
        "/drive",
        "dynamic",
        "1.0 Hz",
        "",
    )
    assert (fixed.owner, fixed.kind, fixed.detail) == ("/static", "static", "")
    assert second.owner == "unknown"


def test_poses_stand_below_and_a_rotation_that_is_none_is_reported(observer: TreeObserver) -> None:
    arrows = {
        (arrow.parent, arrow.child): arrow
        for arrow in graph_of_observers([observer], "/tf", poses=True).arrows
    }
    assert arrows["base", "lidar"].pose == "xyz 0.25 0 0"
    assert arrows["mast", "lidar"].pose == "no rotation"


def test_an_expected_edge_without_a_publisher_is_reported_missing(
    observer: TreeObserver,
) -> None:
    edges = (
        PlanEdge(
            "odom", "base", "dynamic", "drive", "/drive", Pose(), 1.0, SourceLine("rover.yaml", 1)
        ),
        PlanEdge(
            "base", "imu", "static", "static", "/static", Pose(), None, SourceLine("rover.yaml", 2)
        ),
    )
    plan = Plan("rover", "0", "base", RosSettings(), edges, ())
    graph = graph_of_observers([observer], "rover", plan)
    assert [(arrow.child, arrow.owner) for arrow in graph.arrows if arrow.detail == "missing"] == [
        ("imu", "/static")
    ]


@pytest.mark.parametrize(
    ("words", "named"),
    [(["--live", "--bag", "x"], "--bag"), (["--live", "-o", "none/tree.svg"], "none/tree.svg")],
)
def test_what_cannot_be_is_refused_before_ros_is_started(
    words: list[str], named: str, capsys: Any
) -> None:
    assert main(["graph", *words]) == 2
    assert named in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", ["graph --live", "tree --live", "monitor", "echo a b", "doctor"]
)
@pytest.mark.parametrize("name", ["ro bot", "a//b", "1st", "/robot1/tf"])
def test_a_namespace_that_is_none_is_wrong_use(command: str, name: str, capsys: Any) -> None:
    assert main([*command.split(), "--namespace", name]) == 2
    assert f"argument --namespace: {name} is " in capsys.readouterr().err
