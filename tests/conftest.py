"""What tests that run real processes share.

Files named ``test_…_ros.py`` import ROS, and are left out where there is none.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from tests.support import processes
from tests.support.core import copy_core
from tests.support.domains import Domain, entered_domain, reserved_domain
from tests.support.processes import Started
from tests.support.skips import ACCEPTED, unexpected
from tests.support.waiting import TIMEOUT_S, until
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import (
    Clock,
    Plan,
    PlanEdge,
    PlanJoint,
    PlanProcess,
    RosSettings,
    SourceLine,
)
from tfcompose.model.plan.file import write_plan
from tfcompose.tf.ros.environment import FASTDDS_PROFILE, PROFILE_VARIABLES, missing_ros

NO_ROS = missing_ros()
collect_ignore_glob = ["*_ros.py"] if NO_ROS else []

# The same examples at each run, however long they take: what fails once fails again, and a busy
# machine fails none. pytest --hypothesis-profile=default looks for others.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("same")


def pytest_configure(config: pytest.Config) -> None:
    # rclpy's generator package imports an old lark, which imports what Python 3.11 deprecates.
    config.addinivalue_line(
        "filterwarnings", "ignore:module 'sre_.*' is deprecated:DeprecationWarning"
    )
    # The xacro package has an enumeration whose private name Python 3.10 warns of.
    config.addinivalue_line(
        "filterwarnings", "ignore:private variables, such as:DeprecationWarning"
    )


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--fail-on-skips",
        action="store_true",
        help="fail where a test is skipped that need not be",
    )
    parser.addoption("--no-skips", action="store_true", help="fail where any test is skipped")


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    reporter: Any = session.config.pluginmanager.get_plugin("terminalreporter")
    allows_none = session.config.getoption("no_skips")
    if reporter and (allows_none or session.config.getoption("fail_on_skips")):
        accepted = () if allows_none else tuple(ACCEPTED)
        for skip in unexpected(reporter.stats.get("skipped", []), accepted):
            reporter.write_line(f"skipped, and may not be: {skip}", red=True)
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_report_header() -> str:
    return f"ROS: none, so test_*_ros.py are left out ({NO_ROS})" if NO_ROS else "ROS: found"


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Two workers a core, since tests wait more than they work.

    None where single files or tests are named.
    """
    if any(".py" in argument for argument in config.args):
        return 0
    return min(2 * len(os.sched_getaffinity(0)), 16)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # Those that wait, and groups, which one worker has alone, come first, and end with all.
    items.sort(key=lambda item: not any(map(item.get_closest_marker, ("ros", "xdist_group"))))
    with_ros = [item for item in items if item.get_closest_marker("ros")]
    if NO_ROS:
        for item in with_ros:
            item.add_marker(pytest.mark.skip(reason=NO_ROS))
    elif (
        with_ros
    ):  # a node of a test's that leaves slowly on a busy machine does not end all tests
        from tfcompose.tf.ros import node  # noqa: PLC0415 (ROS, which is there)

        node.LEAVE_S = 2 * TIMEOUT_S


def pytest_collection_finish(session: pytest.Session) -> None:
    """Fail where pytest-xdist does not group: each worker would start what a group shares."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        for item in session.items:
            assert item.get_closest_marker("xdist_group") is None or "@" in item.nodeid, (
                item.nodeid
            )


@pytest.fixture(autouse=True)
def _processes() -> Iterator[None]:
    """Heed every signal, and end the processes that a test started.

    Those of a module or the session go on. What else runs below this process at the end was left
    behind.
    """
    before = processes.children()
    with processes.default_signal_actions(), processes.ended_at_exit():
        yield
    until(lambda: not processes.children() - before)
    left = processes.children() - before
    assert not left, [processes.command_line(pid) for pid in left]


@pytest.fixture(scope="session", autouse=True)
def _all_processes() -> Iterator[None]:
    with processes.ended_at_exit():
        yield


@pytest.fixture(scope="session", autouse=True)
def _fastdds_profile(request: pytest.FixtureRequest) -> None:
    """Let nodes of this process announce themselves as tfcompose's own processes do.

    Fast DDS reads its profiles once in a process, with the first node. Stock nodes are found at
    their next announcement only, up to 3 s later.
    """
    if NO_ROS or not any(item.get_closest_marker("ros") for item in request.session.items):
        return
    from tfcompose.tf.ros.node import open_node  # noqa: PLC0415 (ROS, which is there)

    with reserved_domain() as number, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.setenv(PROFILE_VARIABLES[0], str(FASTDDS_PROFILE))
        with open_node("first", ""):
            pass


@pytest.fixture
def domain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Domain]:
    """A domain of the test's own, with runs and logs in folders of the test's own."""
    with entered_domain(tmp_path_factory.mktemp("domain")) as entered:
        yield entered


@pytest.fixture
def node(domain: Domain) -> Iterator[Any]:
    """A node of this process in a domain of its own."""
    assert domain
    # Tests without ROS share this file.
    from tfcompose.tf.ros.node import open_node  # noqa: PLC0415

    with open_node("of_the_test", "/test") as opened:
        yield opened


@pytest.fixture
def nodes(domain: Domain) -> Iterator[Any]:
    """Real nodes that do what a test wants, in the test's domain."""
    assert domain.id
    from tests.support.fake_nodes import FakeNodes  # noqa: PLC0415 (ROS, which may not be there)

    nodes = FakeNodes()
    yield nodes
    nodes.close()


@pytest.fixture
def start(domain: Domain) -> Iterator[Callable[..., Started]]:
    """Start ``tfcompose WORD…`` in the test's domain.

    What still runs at the test's end is killed.
    """
    running: list[Started] = []

    def run(*words: object, **environment: str) -> Started:
        command = [*HERE, *map(str, words)]
        env = {**domain.environment, **environment}
        process = processes.start(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        running.append(Started(process))
        return running[-1]

    yield run
    for started in running:
        started.close()


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package without its tools, in a folder for PYTHONPATH."""
    return copy_core(tmp_path_factory.mktemp("core"))


@pytest.fixture
def python() -> Callable[[str], str]:
    """Run Python code in a process of its own, in this process's environment.

    Return its output.
    """

    def run(code: str) -> str:
        command = [sys.executable, "-c", code]
        return processes.run(command, check=True, timeout_s=TIMEOUT_S).stdout

    return run


@pytest.fixture
def edge() -> Callable[..., PlanEdge]:
    """Make a plan's edge from "parent child", owner and kind."""

    def make(
        names: str, owner: str = "static", pose: Pose | None = None, joint: PlanJoint | None = None
    ) -> PlanEdge:
        parent, child = names.split()
        kind = "joint" if joint else "static" if owner == "static" else "dynamic"
        node = f"/rover/{owner}"
        source = SourceLine("rover.yaml", 1)
        return PlanEdge(parent, child, kind, owner, node, pose or Pose(), None, source, joint)  # type: ignore[arg-type]

    return make


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write a plan with these edges and processes, and its description; return its file."""

    def make(edges: list[PlanEdge], *processes: PlanProcess, clock: Clock = "wall") -> Path:
        named = tuple(p if p.nodes else _with_node(p) for p in processes)
        plan = Plan(
            "rover", "0", "base_link", RosSettings("/rover", clock=clock), tuple(edges), named
        )
        file = tmp_path / "rover.plan.json"
        file.write_text(write_plan(plan), encoding="utf-8")
        (tmp_path / plan.description).write_text("<robot name='rover'/>", encoding="utf-8")
        return file

    return make


def _with_node(process: PlanProcess) -> PlanProcess:
    return PlanProcess(
        process.name, process.kind, nodes=(f"/rover/{process.name}",), simulate=process.simulate
    )
