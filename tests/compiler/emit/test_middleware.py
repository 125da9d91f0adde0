"""Zenoh's router among the processes of a plan, and the middleware that the plan records."""

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan import Plan
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.middleware import ROUTER, ROUTER_PROGRAM, ZENOH_OVERRIDE
from tfcompose.model.plan.topics import private_topics

ROBOT = """
tfcompose: 1
robot: r
ros: {ROS}
guard: {mode: GUARD}
frames: {odom: {}, base_link: {parent: odom, owner: drive, rate: 20 Hz}, lidar: {parent: base_link, xyz: [0, 0, 1]}}
processes:
  static: {host: HOST}
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}, host: HOST}
  bringup: {external: true}
MORE
rules: {TF815: off}
"""  # noqa: E501 (a text as its reader has it)


def built(ros: str, more: str = "", guard: str = "watch", host: str = "brain") -> Plan:
    text = (
        ROBOT.replace("ROS", ros)
        .replace("MORE", more)
        .replace("GUARD", guard)
        .replace("HOST", host)
    )
    compiled = compile_robot(text, "r.yaml", library())
    assert compiled.robot
    assert not compiled.errors, compiled.errors
    files = {file.path: file.text for file in emit(compiled.robot)}
    return read_plan(files["plan.json"], "plan.json")


def test_on_zenoh_one_router_is_a_process_and_every_process_waits_for_it() -> None:
    plan = built("rmw: zenoh, discovery: localhost")
    router = plan.process(ROUTER)
    assert (router.kind, router.argv, router.host) == ("run", (ROUTER_PROGRAM,), "brain")
    assert router.ready is not None
    assert router.ready.kind == "log"
    assert router.emulate_tty, "it does not flush its line otherwise"
    assert router.env == {ZENOH_OVERRIDE: 'listen/endpoints=["tcp/localhost:7447"]'}
    waiting = {
        process.name: dict(process.after) for process in plan.started if process.name != ROUTER
    }
    assert waiting == {name: {ROUTER: "ready"} for name in ("static", "drive", "guard")}
    assert plan.process("bringup").after == {}


def test_other_middlewares_have_no_router() -> None:
    for rmw in ("fastdds", "cyclonedds"):
        plan = built(f"rmw: {rmw}")
        assert plan.ros.rmw == rmw
        assert ROUTER not in {process.name for process in plan.processes}


def test_a_router_of_the_file_takes_the_place_of_the_one_that_is_added() -> None:
    plan = built("rmw: zenoh", "  router: {run: {package: rmw_zenoh_cpp, executable: rmw_zenohd}}")
    assert ROUTER not in {process.name for process in plan.processes}
    router = plan.process("router")
    assert router.ready is not None
    assert router.ready.kind == "log"
    assert plan.process("static").after == {"router": "ready"}
    elsewhere = built("rmw: zenoh", f"  {ROUTER}: {{external: true}}")
    assert elsewhere.process(ROUTER).kind == "external"
    assert elsewhere.process("static").after == {ROUTER: "ready"}


def test_what_stands_under_the_routers_name_adds_to_it() -> None:
    plan = built(
        "rmw: zenoh, router: tcp/10.0.0.2:7448",
        f"  {ROUTER}: {{host: rear, env: {{RUST_LOG: debug}}}}",
    )
    router = plan.process(ROUTER)
    assert router.host == "rear"
    assert router.env == {
        ZENOH_OVERRIDE: 'listen/endpoints=["tcp/[::]:7448"]',
        "RUST_LOG": "debug",
    }
    assert router.argv == (ROUTER_PROGRAM,)


def test_what_the_router_waits_for_does_not_wait_for_it() -> None:
    plan = built("rmw: zenoh", f"  net: {{run: [net]}}\n  {ROUTER}: {{after: {{net: started}}}}")
    assert plan.process("net").after == {}
    assert plan.process(ROUTER).after == {"net": "started"}


def test_strict_does_not_remap_the_router() -> None:
    plan = built("rmw: zenoh", guard="strict")
    assert private_topics(plan).keys() == {"static", "drive"}


def test_a_part_brings_no_second_router() -> None:
    outer = ROBOT.replace("ROS", "rmw: zenoh").replace("GUARD", "watch").replace("HOST", "brain")
    part = "tfcompose: 1\nrobot: arm\nros: {rmw: zenoh}\nframes: {hand: {}}\n"
    text = outer.replace("MORE", "parts: {arm: {spec: arm.yaml, parent: base_link, prefix: arm_}}")
    compiled = compile_robot(text, "r.yaml", library(), read=lambda _: part)
    assert compiled.robot
    assert not compiled.errors, compiled.errors
    assert [process.name for process in compiled.robot.processes].count(ROUTER) == 1
