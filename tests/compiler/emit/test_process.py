"""Settings of a process reach the plan; impossible ones are refused with their place."""

import json
import math
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.launcher.kernel_settings import SETTINGS
from tfcompose.launcher.preflight import fill_argv, folder_of, own_env
from tfcompose.model.files import Target
from tfcompose.model.plan import PlanProcess, Ready, StopRule
from tfcompose.model.plan.components import ros_value
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.model.robot import Process
from tfcompose.spec.language.process import keys_of

HEAD = (
    "tfcompose: 1\nrobot: r\nros: {namespace: r1}\nframes: {map: {}}\nrules: {TF818: off, TF848:"
    " off}\nprocesses:\n"
)
EXE = "run: {package: p, executable: e}"


def files_of(processes: str, head: str = HEAD) -> dict[str, str]:
    compiled = compile_robot(f"{head}  {processes}\n", "r.yaml", library())
    assert compiled.robot
    assert not compiled.errors, compiled.findings
    return {file.path: file.text for file in emit(compiled.robot)}


def process_of(keys: str, head: str = HEAD) -> PlanProcess:
    text = files_of(f"a: {{{keys}}}", head)["plan.json"]
    plan = read_plan(text, "plan.json")
    assert write_plan(plan) == text, "what was read is written again as it was"
    return plan.process("a")


REACH: dict[str, dict[str, Any]] = {
    "": {
        "required": None,
        "max_restarts": None,
        "stop": StopRule(),
        "log_level": None,
        "ready": None,
        "host": None,
    },
    "required: true": {"required": True},
    "required: false": {"required": False},
    "host: jetson": {"host": "jetson"},
    "env: {B: c}": {"env": {"B": "c"}},
    "cwd: maps": {"cwd": "${build_dir}/maps"},
    "remap: {/scan: /front}": {"remap": {"/scan": "/front"}},
    "log_level: debug": {"log_level": "debug"},
    "after: {static: started}": {"after": {"static": "started"}},
    "restart: always, max_restarts: 3": {"restart": "always", "max_restarts": 3},
    "restart: always, restart_delay: 5 s": {"restart_delay": 5.0},
    "prefix: [nice, -n, '10']": {"prefix": ("nice", "-n", "10")},
    "stop: {signal: SIGTERM, timeout: 200 ms}": {"stop": StopRule("SIGTERM", 0.2)},
    "stop: {kill_timeout: 9 s}": {"stop": StopRule(kill_timeout_s=9.0)},
    "output: log": {"output": "log"},
    "emulate_tty: true": {"emulate_tty": True},
    "stop: {}": {"stop": StopRule("SIGINT", None)},
    "ready: edges": {"ready": Ready("edges")},
    "ready: {edges: true, timeout: 1 min}": {"ready": Ready("edges", timeout_s=60.0)},
    "namespace: front/left": {"namespace": "r1/front/left", "nodes": ("/r1/front/left/a",)},
    "namespace: /front": {"namespace": "front", "nodes": ("/front/a",)},
    "namespace: front, node: b": {"nodes": ("/r1/front/b",)},
    "namespace: front, node: /b": {"nodes": ("/b",)},
    "namespace: front, ready: {topic: scan}": {"ready": Ready("topic", "/r1/front/scan")},
    "ready: {topic: scan}": {"ready": Ready("topic", "/r1/scan")},
    "ready: {topic: /scan, timeout: 3}": {"ready": Ready("topic", "/scan", timeout_s=3.0)},
    "ready: {service: a/b}": {"ready": Ready("service", "/r1/a/b")},
    "ready: {lifecycle: inactive}": {"ready": Ready("lifecycle", "inactive")},
    "ready: {log: 'up .*$'}": {"ready": Ready("log", "up .*$")},
    "ready: {exit: 3}": {"ready": Ready("exit", number=3.0)},
    "ready: {time: 1500 ms}": {"ready": Ready("time", number=1.5)},
    "lifecycle: active, node: /n": {"lifecycle": {"/n": "active"}},
    "nodes: {n: {lifecycle: inactive}, /m: {}}": {
        "lifecycle": {"/r1/n": "inactive"},
        "nodes": ("/r1/n", "/m"),
    },
}


@pytest.mark.parametrize("keys", REACH)
def test_a_key_of_a_process_reaches_the_plan(keys: str) -> None:
    head = (
        HEAD.replace("map: {}", "map: {}, odom: {parent: map, owner: a}")
        if "edges" in keys
        else HEAD
    )
    process = process_of(f"{EXE}, {keys}".rstrip(", "), head)
    assert {name: getattr(process, name) for name in REACH[keys]} == REACH[keys]


def test_no_key_that_a_process_of_the_plan_has_as_well_is_left_out() -> None:
    shared = {field.name for field in fields(Process) if field.init} & keys_of("run")
    shared -= {setting.key for setting in SETTINGS}  # which are followed into the process itself
    assert shared <= {name for words in REACH.values() for name in words}


def test_infinite_parameters_reach_a_node_and_a_component() -> None:
    """JSON, which a component's are in, has no such number, nor has Python's syntax."""
    params = "params: {far: .inf, near: -.inf, no: .nan, all: [.inf, 1.0]}"
    text = f"b: {{{EXE}, {params}}}\n  a: {{component: p/C, container: box, {params}}}"
    head = HEAD.replace("processes:", "containers: {box: {}}\nprocesses:")
    files = files_of(text, head)
    of_node = yaml.safe_load(files["params/b.yaml"])["/r1/b"]["ros__parameters"]
    plan = read_plan(files["plan.json"], "plan.json")
    assert write_plan(plan) == files["plan.json"]
    component = plan.process("a").component
    assert component
    loaded = {name: ros_value(value) for name, value in component.params.items()}
    for values in (of_node, loaded):
        assert repr(values) == repr(
            {"far": math.inf, "near": -math.inf, "no": math.nan, "all": [math.inf, 1.0]}
        )


SECTIONS = """
/**: {ros__parameters: {x: 1, in: {x: 2, y: 3}}}
/*/a: {ros__parameters: {x: 4, z: 5}}
/r1/b: {ros__parameters: {x: 6}}
"""


def test_a_path_from_the_launcher_precedes_every_section_of_its_node(
    tmp_path: Path,
) -> None:
    """The command line counts for /**, which a pattern that comes later is laid over."""
    (tmp_path / "a.yaml").write_text(SECTIONS, encoding="utf-8")
    params = "params: {file: a.yaml, x: '${file(a.png)}', in: {x: '${file(b.png)}'}}"
    text = f"{HEAD}  a: {{{EXE}, {params}}}\n"
    robot = compile_robot(text, str(tmp_path / "r.yaml"), library(), read=read_text).robot
    assert robot
    files = {file.path: file.text for file in emit(robot)}
    nodes = yaml.safe_load(files["params/a.yaml"])
    assert {name: node["ros__parameters"] for name, node in nodes.items()} == {
        "/**": {"in": {"y": 3}},
        "/*/a": {"z": 5},
        "/r1/b": {"x": 6},
        "/r1/a": {"in": {"y": 3}, "z": 5},
    }
    argv = read_plan(files["plan.json"], "plan.json").process("a").argv
    assert [word.partition(":=")[0] for word in argv if word.startswith(("x:=", "in.x:="))] == [
        "x",
        "in.x",
    ]


COMMANDS: dict[str, tuple[str, ...]] = {
    f"{EXE}, log_level: debug": (
        "${executable:p/e}",
        "--ros-args",
        "-r",
        "__node:=a",
        "-r",
        "__ns:=/r1",
        "--log-level",
        "debug",
    ),
    f"{EXE}, nodes: {{m: {{}}, n: {{}}}}": ("${executable:p/e}", "--ros-args", "-r", "__ns:=/r1"),
    "run: {launch: p/l.launch.py, args: {x: 1, y: true, z: a b, h: '${1/2}', n: '${4/2}'}}": (
        "${launch:p/l.launch.py}",
        "x:=1",
        "y:=true",
        "z:=a b",
        "h:=0.5",
        "n:=2",
    ),
    "run: {launch: p/l.launch.py, args: ['x:=1']}": ("${launch:p/l.launch.py}", "x:=1"),
    "run: 'a | b', shell: true": ("/bin/sh", "-c", "a | b"),
    "run: [a, '|', b]": ("a", "|", "b"),
    "run: [a], env: {B: c}, restart: always, node: n": ("a",),
    "run: [a, --now], log_level: debug": (
        "a",
        "--now",
        "--ros-args",
        "-r",
        "__ns:=/r1",
        "--log-level",
        "debug",
    ),
    "run: [a], namespace: front": ("a", "--ros-args", "-r", "__ns:=/r1/front"),
    "run: [a], namespace: front, nodes: {m: {}, n: {}}": (
        "a",
        "--ros-args",
        "-r",
        "__ns:=/r1/front",
    ),
    "run: [a], namespace: front, params: {x: 1}": (
        "a",
        "--ros-args",
        "-r",
        "__node:=a",
        "-r",
        "__ns:=/r1/front",
        "--params-file",
        "${params_file}",
    ),
    "run: [a], remap: {/scan: /front}": (
        "a",
        "--ros-args",
        "-r",
        "__ns:=/r1",
        "-r",
        "/scan:=/front",
    ),
    "run: [a], params: {x: 1}": (
        "a",
        "--ros-args",
        "-r",
        "__node:=a",
        "-r",
        "__ns:=/r1",
        "--params-file",
        "${params_file}",
    ),
    "run: [a], nodes: {m: {params: {x: 1}}, n: {}}": (
        "a",
        "--ros-args",
        "-r",
        "__ns:=/r1",
        "--params-file",
        "${params_file}",
    ),
    "run: [a, '${params_file}'], params: {x: 1}": ("a", "${params_file}"),
    "run: [a, --ros-args, -p, 'y:=2'], remap: {b: c}": (
        "a",
        "--ros-args",
        "-p",
        "y:=2",
        "--ros-args",
        "-r",
        "__ns:=/r1",
        "-r",
        "b:=c",
    ),
    "run: 'a | b', shell: true, remap: {/scan: /front}": ("/bin/sh", "-c", "a | b"),
}


@pytest.mark.parametrize("keys", COMMANDS)
def test_how_it_is_run_becomes_words_that_the_launcher_can_follow(keys: str) -> None:
    assert process_of(keys).argv == COMMANDS[keys]


def test_a_command_that_owns_an_edge_gets_ros_arguments_and_others_do_not() -> None:
    head = HEAD.replace("namespace: r1", "namespace: r1, isolate: topics, clock: sim")
    head = head.replace("{map: {}}", "{map: {}, odom: {parent: map, owner: drive}}")
    plan = read_plan(
        files_of("drive: {run: [drive]}\n  web: {run: [serve, --port, '80']}", head)["plan.json"],
        "p",
    )
    remaps = ("-r", "/tf:=/r1/tf", "-r", "/tf_static:=/r1/tf_static")
    below = ("-r", "__ns:=/r1")
    assert plan.process("drive").argv == (
        "drive",
        "--ros-args",
        *below,
        *remaps,
        "-p",
        "use_sim_time:=true",
    )
    assert plan.process("web").argv == ("serve", "--port", "80")


def test_each_node_of_a_process_has_its_own_parameters_under_its_full_name() -> None:
    text = files_of(
        f"a: {{{EXE}, nodes: {{m: {{params: {{x: 1}}}}, /q/n: {{params: {{y: b}}}}, o: {{}}}}}}"
    )
    params = yaml.safe_load(text["params/a.yaml"])
    assert params == {
        "/r1/m": {"ros__parameters": {"x": 1}},
        "/q/n": {"ros__parameters": {"y": "b"}},
    }


REFUSED = {
    "run: 'a | b'": ("TF103", "'a | b'"),
    "run: [a], shell: true": ("TF107", "shell"),
    "run: {launch: nav.py}": ("TF106", "nav.py"),
    "run: {launch: a/b, package: c}": ("TF107", "package"),
    "run: [x], ready: {timeout: 3 s}": ("TF102", "ready"),
    "run: [x], ready: {log: '('}": ("TF106", "'('"),
    "run: [x], ready: {topic: a, service: b}": ("TF107", "service"),
    "run: [x], ready: soon": ("TF103", "soon"),
    "run: [x], stop: {signal: SIGFOO}": ("TF106", "SIGFOO"),
    "run: [x], stop: {timeout: 0}": ("TF106", "0"),
    "run: [x], nodes: {a b: {}}": ("TF106", "a b"),
    "run: [x], nodes: {a: {}}, node: b": ("TF107", "node"),
    "run: [x], max_restarts: -1": ("TF106", "-1"),
    "run: [x], required: 1": ("TF103", "1"),
}


@pytest.mark.parametrize("keys", REFUSED)
def test_what_cannot_be_meant_is_one_finding_at_its_place(keys: str) -> None:
    text = f"{HEAD}  a: {{{keys}}}\n"
    (finding,) = compile_robot(text, "r.yaml", library()).findings
    span = finding.span
    assert span
    assert (
        finding.code,
        text.splitlines()[span.line - 1][span.column - 1 : span.end_column - 1],
    ) == REFUSED[keys]


def test_a_stand_in_takes_the_place_of_a_shells_command() -> None:
    """A profile drops ``run`` and keeps ``shell``, which says nothing then."""
    text = (
        f"{HEAD}  a: {{run: 'x | y', shell: true}}\nprofiles: {{sim: {{processes: {{a: {{external:"
        " true}}}}\n"
    )
    assert [
        finding.code for finding in compile_robot(text, "r.yaml", library(), ["sim"]).findings
    ] == []


def test_a_stand_in_is_kept_and_ended_as_what_it_stands_in_for() -> None:
    """A gate on what only the real one does is not its own, nor is the folder."""
    how = (
        "restart: always, max_restarts: 2, stop: {timeout: 3 s}, remap: {/tf: /seen/tf}, env:"
        " {A: b}"
    )
    text = f"{HEAD}  a: {{run: [x], {how}, cwd: ., ready: {{log: up}}, params: {{b: 1}}}}\n"
    text += "profiles: {sim: {processes: {a: {simulate: {fixed: {}}}}}}\n"
    compiled = compile_robot(text, "r.yaml", library(), ["sim"])
    assert compiled.findings == ()
    assert compiled.robot
    stand_in = next(process for process in compiled.robot.processes if process.name == "a")
    assert (stand_in.restart, stand_in.max_restarts, stand_in.stop.timeout_s) == ("always", 2, 3.0)
    assert (stand_in.remap, stand_in.env) == ({"/tf": "/seen/tf"}, {"A": "b"})
    assert (stand_in.cwd, stand_in.ready, stand_in.params) == (None, None, {})


FILES = """tfcompose: 1
robot: r
frames: {map: {}}
processes:
  a:
    run: {package: p, executable: e, args: ["--map=${file(maps/a.yaml)}", "${build_dir}/x"]}
    params: {n: 1, path: "${file(maps)}/b.yaml", deep: {all: ["${file(maps/a.yaml)}", c], m: 2}}
    env: {URI: "file://${file(maps/a.yaml)}"}
"""


def built_at(
    tmp_path: Path, folder: str, text: str = FILES
) -> list[Finding] | tuple[str, PlanProcess]:
    """Return the plan's text and its process, built to a folder beside the robot's.

    Or what was found.
    """
    (tmp_path / "robots/maps").mkdir(parents=True, exist_ok=True)
    (tmp_path / "robots/maps/a.yaml").touch()
    file = tmp_path / "robots/r.yaml"
    compiled = compile_robot(text, str(file), library(), disk=disk())
    if compiled.findings:
        return list(compiled.findings)
    assert compiled.robot
    files = {
        file.path: file.text
        for file in emit(compiled.robot, Target(folder=str(tmp_path / folder)))
    }
    assert yaml.safe_load(files["params/a.yaml"]) == {
        "/a": {"ros__parameters": {"n": 1, "deep": {"m": 2}}}
    }
    return files["plan.json"], read_plan(files["plan.json"], "plan.json").process("a")


def test_a_file_path_is_relative_to_the_plan_and_found_from_any_folder(
    tmp_path: Path,
) -> None:
    built = built_at(tmp_path, "build/r")
    assert isinstance(built, tuple)
    text, process = built
    assert str(tmp_path) not in text
    filled = fill_argv(process, tmp_path / "build/r/plan.json")
    (tmp_path / "build/r").mkdir(parents=True)
    paths = [
        filled[1].removeprefix("--map="),
        *(json.loads(word.partition(":=")[2]) for word in filled[-3::2]),
    ]
    maps = tmp_path / "robots/maps"
    assert [os.path.realpath(path) for path in (paths[0], paths[1], paths[2][0])] == [
        str(maps / name) for name in ("a.yaml", "b.yaml", "a.yaml")
    ]
    assert filled[2] == str(tmp_path / "build/r/x")
    uri = own_env(process, tmp_path / "build/r/plan.json")["URI"]
    assert os.path.realpath(uri.removeprefix("file://")) == str(maps / "a.yaml")


@pytest.mark.parametrize(
    ("cwd", "place"),
    [("maps", "robots/maps"), (".", "robots"), ('"${file(maps)}"', "robots/maps"), ("/", "/")],
)
def test_a_process_runs_in_the_folder_of_the_file_that_names_it(
    tmp_path: Path, cwd: str, place: str
) -> None:
    built = built_at(tmp_path, "build/r", f"{FILES}    cwd: {cwd}\n")
    assert isinstance(built, tuple)
    build_dir = tmp_path / "build/r"
    assert folder_of(built[1], build_dir / "plan.json", build_dir) == tmp_path / place


def test_the_same_robot_in_another_place_is_built_to_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    assert built_at(tmp_path / "one", "build/r") == built_at(tmp_path / "two", "build/r")


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('a.yaml)}", c', 'no.yaml)}", c', "TF019"),
        ("file(maps)", "file(/maps)", "TF106"),
        ("run: {package: p, executable: e", "run: {launch: p/e", "TF816"),
        (
            'n: 1, path: "${file(maps)}/b.yaml", deep: {all: ["${file(maps/a.yaml)}", c], m: 2}',
            "",
            "TF816",
        ),
    ],
)
def test_a_file_that_is_missing_or_of_no_known_format_is_a_finding(
    tmp_path: Path, old: str, new: str, code: str
) -> None:
    text = FILES.replace("${build_dir}/x", "${params_file}")
    assert old in text
    result = built_at(tmp_path, "build/r", text.replace(old, new))
    assert isinstance(result, list)
    assert code in [finding.code for finding in result]


def test_a_node_that_is_listed_alone_does_not_rename_the_others() -> None:
    """ros2_control_node has controller_manager besides the controllers that are listed."""
    listed = process_of(f"{EXE}, nodes: {{drive: {{params: {{rate: 5}}}}}}")
    assert not [word for word in listed.argv if word.startswith("__node")]
    assert "__ns:=/r1" in listed.argv
    assert listed.nodes == ("/r1/drive",)
    assert "__node:=drive" in process_of(f"{EXE}, node: drive").argv


def test_parameters_of_a_process_with_nodes_are_for_each_of_its_nodes() -> None:
    nodes = "nodes: {b: {params: {x: 3}}, c: {}}, params: {x: 1, y: 2}"
    files = files_of(f"a: {{{EXE}, {nodes}}}")
    params = yaml.safe_load(files["params/a.yaml"])
    params_by_node = {node: value["ros__parameters"] for node, value in params.items()}
    assert params_by_node == {
        "/**": {"x": 1, "y": 2},
        "/r1/b": {"x": 3, "y": 2},
        "/r1/c": {"x": 1, "y": 2},
    }


ROS2 = {
    "run: [ros2, run, p, e]": "run: {package: p, executable: e}",
    "run: [ros2, run, p, e, --fast, now]": "run: {package: p, executable: e, args: [--fast, now]}",
    "run: [ros2, launch, p, f.launch.py]": "run: {launch: p/f.launch.py}",
    'run: [ros2, launch, p, f.launch.py, "map:=a"]': (
        "run: {launch: p/f.launch.py, args: {map: a}}"
    ),
}


@pytest.mark.parametrize("words", ROS2)
def test_a_ros2_command_starts_as_its_package_or_launch_file(words: str) -> None:
    more = "params: {rate: 5}" if "executable" in ROS2[words] else "log_level: debug"
    assert process_of(f"{words}, {more}") == process_of(f"{ROS2[words]}, {more}")


@pytest.mark.parametrize(
    "words", ["./f.launch.py", "--debug, p, f.launch.py", "p, f.launch.py, --debug"]
)
def test_a_launch_file_that_is_left_to_ros2_gets_no_ros_arguments(words: str) -> None:
    head = HEAD.replace(
        "frames: {map: {}}", "frames: {map: {}, odom: {parent: map, owner: a, rate: 9}}"
    )
    assert process_of(f"run: [ros2, launch, {words}], node: b", head).argv == (
        "ros2",
        "launch",
        *words.split(", "),
    )


COMPONENT = "component: p/ns::C, container: box"


def with_box(keys: str = "", head: str = HEAD) -> str:
    return head.replace("processes:", f"containers: {{box: {{{keys}}}}}\nprocesses:")


def component_of(keys: str = "", box: str = "", head: str = HEAD) -> PlanProcess:
    return process_of(f"{COMPONENT}{keys}", with_box(box, head))


@pytest.mark.parametrize(
    ("keys", "command"),
    [
        ("", ("component_container",)),
        ("executor: multi", ("component_container_mt",)),
        ("isolation: isolated", ("component_container_isolated",)),
        (
            "isolation: isolated, executor: multi, args: [-v]",
            ("component_container_isolated", "--use_multi_threaded_executor", "-v"),
        ),
        ("executable: mine, args: [-v]", ("mine", "-v")),
    ],
)
def test_a_container_is_the_stock_program_by_isolation_and_executor(
    keys: str, command: tuple[str, ...]
) -> None:
    plan = read_plan(files_of(f"a: {{{COMPONENT}}}", with_box(keys))["plan.json"], "plan.json")
    box = plan.process("box")
    named = ("--ros-args", "-r", "__node:=box", "-r", "__ns:=/r1")
    assert box.argv == (f"${{executable:rclcpp_components/{command[0]}}}", *command[1:], *named)
    assert box.ready == Ready("service", "/r1/box/_container/load_node")


def test_a_component_is_loaded_with_typed_parameters_and_started_by_nobody() -> None:
    params = (
        ", namespace: front, params: {n: 1, r: 2.0, deep: {er: true}, l: [1, 2.5], t: '1'}, remap:"
        " {a: b}"
    )
    process = component_of(f"{params}, extra_arguments: {{use_intra_process_comms: true}}")
    assert (process.kind, process.argv, process.params_file) == ("component", (), None)
    assert process.nodes == ("/r1/front/a",)
    assert process.component
    assert (process.component.package, process.component.plugin) == ("p", "ns::C")
    assert process.component.params == {
        "n": 1,
        "r": 2.0,
        "deep.er": True,
        "l": [1.0, 2.5],
        "t": "1",
    }
    assert isinstance(process.component.params["r"], float)
    assert process.component.extra_arguments == {"use_intra_process_comms": True}
    assert process.remap == {"a": "b"}
    assert process.after == {"box": "ready"}


def test_a_component_has_the_clock_and_the_topics_of_the_robot() -> None:
    process = component_of(
        head=HEAD.replace("{namespace: r1}", "{namespace: r1, clock: sim, isolate: topics}")
    )
    assert process.component
    assert process.component.params == {"use_sim_time": True}
    assert process.remap == {"/tf": "/r1/tf", "/tf_static": "/r1/tf_static"}


def test_a_component_runs_where_its_container_does_and_is_as_needed() -> None:
    process = component_of(box="host: jetson, required: false")
    assert (process.host, process.required) == ("jetson", False)
    assert component_of(", required: true", "host: jetson, required: false").required is True


def test_words_of_a_parameter_file_are_values_as_ros_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "params.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {n: 7, r: 1e3, on: yes, t: '7', w: word, l: [1, 2.0], h: 0x10}\n"
    )
    text = f"{with_box()}  a: {{{COMPONENT}, params: {{file: params.yaml, n: 8}}}}\n"
    compiled = compile_robot(
        text, str(tmp_path / "r.yaml"), library(), read=lambda path: Path(path).read_text()
    )
    assert compiled.robot
    (component,) = [
        process.component for process in plan_of(compiled.robot).processes if process.component
    ]
    assert component.params == {
        "n": 8,
        "r": 1000.0,
        "on": True,
        "t": "7",
        "w": "word",
        "l": [1.0, 2.0],
        "h": 16,
    }


def test_a_component_of_a_part_is_in_the_parts_container(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(
        f"{with_box()}  a: {{{COMPONENT}}}\n".replace("robot: r\n", "robot: arm\n")
    )
    text = (
        "tfcompose: 1\nrobot: r\nframes: {base: {}}\nparts: {left: {spec: arm.yaml, parent:"
        " base}}\n"
    )
    compiled = compile_robot(
        text, str(tmp_path / "r.yaml"), library(), read=lambda path: Path(path).read_text()
    )
    assert compiled.robot
    process = plan_of(compiled.robot).process("left/a")
    assert process.component
    assert process.component.container == "left/box"
    assert process.after == {"left/box": "ready"}


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ('"container": "box"', '"container": "bax"', "bax"),
        ('"container": "box"', '"container": "a"', "a"),
        ('"kind": "component"', '"kind": "run"', "run"),
        ('"nodes": ["/r1/a"]', '"nodes": []', "node"),
    ],
)
def test_a_plan_whose_component_nobody_can_load_is_refused(old: str, new: str, word: str) -> None:
    text = files_of(f"a: {{{COMPONENT}}}", with_box())["plan.json"]
    assert old in text
    with pytest.raises(RejectedError) as error:
        read_plan(text.replace(old, new), "plan.json")
    assert [finding.code for finding in error.value.findings] == ["TF902"]
    assert word in error.value.findings[0].message


def test_a_sensor_driver_may_be_a_component_with_its_presets_parameters() -> None:
    head = with_box().replace("map: {}", "base: {}").replace("processes:", "sensors:")
    driver = (
        "component: 'realsense2_camera/realsense2_camera::RealSenseNodeFactory', container: box,"
        " params: {x: 1}"
    )
    plan = read_plan(
        files_of(f"eye: {{preset: realsense/d435i, parent: base, driver: {{{driver}}}}}", head)[
            "plan.json"
        ],
        "p",
    )
    eye = plan.process("eye")
    assert eye.component
    assert (eye.component.container, eye.component.plugin) == (
        "box",
        "realsense2_camera::RealSenseNodeFactory",
    )
    assert (
        eye.component.params.items() >= {"x": 1, "camera_name": "eye", "publish_tf": True}.items()
    )
    assert ("eye_link", "eye_depth_frame") in eye.owns
    assert [driven.sensor for driven in eye.drives] == ["eye"]
