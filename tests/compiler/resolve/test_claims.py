"""Claims of nodes are switched off, renamed as in the tree, or reported."""

from typing import Any

import pytest
import yaml

from tests.support.findings import words
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.resolve.presets import node_preset, node_preset_names
from tfcompose.model.plan.file import read_plan

ROBOT = """tfcompose: 1
robot: r
ros: {namespace: r1, ROS}
frames:
  map: {}
  odom: {parent: map, owner: slam, rate: 10 Hz}
  base_link: {parent: odom, owner: ekf, rate: 50 Hz}
processes:
  slam: {run: {package: slam_toolbox, executable: async_slam_toolbox_node}, node: {preset: slam_toolbox}}
  ekf: {run: {package: robot_localization, executable: ekf_node}, node: {preset: ekf}}
"""  # noqa: E501 (a text as its reader has it)


def compiled(more: str = "", *, ros: str = "isolate: none", **changes: str) -> Compiled:
    text = ROBOT.replace("ROS", ros)
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return compile_robot(f"{text}{more}", "r.yaml", library())


def files_of(done: Compiled) -> dict[str, str]:
    assert not done.findings, done.findings
    assert done.robot
    return {file.path: file.text for file in emit(done.robot)}


def params_of(done: Compiled, process: str) -> dict[str, dict[str, Any]]:
    read = yaml.safe_load(files_of(done)[f"params/{process}.yaml"])
    return {node: params["ros__parameters"] for node, params in read.items()}


def output(done: Compiled) -> list[str]:
    return [f"{finding.code} {finding.message}" for finding in done.findings]


PREFIXED = "isolate: frames, shared_frames: [map]"


@pytest.mark.parametrize(("ros", "prefix"), [("isolate: none", ""), (PREFIXED, "r1/")])
def test_the_parameters_that_hold_frames_names_agree_with_the_tree(ros: str, prefix: str) -> None:
    slam = {"map_frame": "map", "odom_frame": f"{prefix}odom", "base_frame": f"{prefix}base_link"}
    assert params_of(compiled(ros=ros), "slam") == {"/r1/slam": slam}
    ekf = {
        "map_frame": "map",
        "odom_frame": f"{prefix}odom",
        "base_link_frame": f"{prefix}base_link",
    }
    assert params_of(compiled(ros=ros), "ekf") == {
        "/r1/ekf": ekf | {"world_frame": f"{prefix}odom"}
    }


def test_a_filter_that_owns_the_upper_edge_is_configured_to() -> None:
    more = "  drive: {external: true}\n"
    done = compiled(more, **{"owner: ekf": "owner: drive", "owner: slam": "owner: ekf"})
    assert params_of(done, "ekf")["/r1/ekf"]["world_frame"] == "map"
    assert params_of(done, "slam")["/r1/slam"]["transform_publish_period"] == 0.0


def test_a_filter_that_sends_another_edge_than_its_own_is_found() -> None:
    output = {"preset: ekf}": "preset: ekf}, params: {base_link_frame_output: base_footprint}"}
    (finding,) = compiled(**output).findings
    assert finding.code == "TF333"
    assert {"base_link_frame_output", "'base_footprint'", "'base_link'"} <= words(finding)


def test_unusual_names_are_set_too() -> None:
    names = {
        "map: ": "world: ",
        "parent: map": "parent: world",
        "odom: {": "local: {",
        "parent: odom": "parent: local",
    }
    done = compiled(**names)
    assert params_of(done, "slam")["/r1/slam"] == {
        "map_frame": "world",
        "odom_frame": "local",
        "base_frame": "base_link",
    }
    parameters = params_of(done, "ekf")["/r1/ekf"]
    assert (parameters["odom_frame"], parameters["world_frame"]) == ("local", "local")


CONTROL = """  control:
    run: {package: controller_manager, executable: ros2_control_node}
    nodes: {controller_manager: {}, diff: {preset: diff_drive_controller}}
"""
CLAIMS: dict[str, tuple[str, str, dict[str, Any]]] = {
    CONTROL: ("control", "/r1/diff", {"enable_odom_tf": False, "tf_frame_prefix_enable": False}),
    "  a: {run: {package: p, executable: e}, node: {preset: amcl}}\n": (
        "a",
        "/r1/a",
        {"tf_broadcast": False},
    ),
    "  a: {run: {package: p, executable: e}, node: {preset: rtabmap}}\n": (
        "a",
        "/r1/a",
        {"publish_tf": False},
    ),
    "  a: {run: {package: p, executable: e}, publishes: [{parent: odom, child: base_link, off: {x.y: 0}}]}\n": (  # noqa: E501 (a text as its reader has it)
        "a",
        "/r1/a",
        {"x.y": 0},
    ),
    "  a: {run: [a], node: {preset: amcl}}\n": ("a", "/r1/amcl", {"tf_broadcast": False}),
    "  a: {run: [a, '${params_file}'], params: {b: 1}, node: {preset: create3}}\n": (
        "a",
        "/r1/robot_state",
        {"b": 1, "publish_odom_tfs": False},
    ),
}


@pytest.mark.parametrize("more", CLAIMS)
def test_an_edge_of_another_owner_is_switched_off_in_the_nodes_parameters(
    more: str,
) -> None:
    process, node, switch = CLAIMS[more]
    foot = {"  base_link:": "  base_footprint: {parent: odom, owner: foot}\n  base_link:"}
    parameters = params_of(compiled(f"{more}  foot: {{external: true}}\n", **foot), process)
    assert {key: parameters[node].get(key) for key in switch} == switch
    assert set(parameters) == {node}


def test_the_node_of_several_that_publishes_an_edge_is_its_publisher() -> None:
    done = compiled(CONTROL, **{"owner: ekf": "owner: control"})
    plan = read_plan(files_of(done)["plan.json"], "plan.json")
    assert {edge.child: edge.node for edge in plan.edges} == {
        "odom": "/r1/slam",
        "base_link": "/r1/diff",
    }
    assert "enable_odom_tf" not in params_of(done, "control")["/r1/diff"]
    assert params_of(done, "ekf")["/r1/ekf"]["publish_tf"] is False


def test_only_the_owner_configures_a_node_that_publishes_on_demand() -> None:
    more = CONTROL.replace("diff_drive", "tricycle")
    assert params_of(compiled(more, **{"owner: ekf": "owner: control"}), "control")["/r1/diff"][
        "enable_odom_tf"
    ]
    assert "enable_odom_tf" not in params_of(compiled(more), "control")["/r1/diff"]


#: The code, the names in the message, and what the help holds.
FINDINGS = {
    "  a: {external: true, node: {preset: amcl}}\n": (
        "TF330",
        "a map odom slam",
        "tf_broadcast: false",
    ),
    "  a: {run: a, shell: true, node: {preset: diff_drive_controller}}\n": (
        "TF330",
        "a odom base_link ekf",
        "enable_odom_tf: false",
    ),
    "  a: {run: {package: p, executable: e}, publishes: [{parent: map, child: odom, off: none}]}\n": (  # noqa: E501 (a text as its reader has it)
        "TF330",
        "a map odom slam",
        "owner",
    ),
    "  a: {run: {package: p, executable: e}, publishes: [{parent: map, child: dock, off: {dock: false}}]}\n": (  # noqa: E501 (a text as its reader has it)
        "TF331",
        "a map dock",
        "frames: {dock: {parent: map, owner: a}}; or params: {dock: false}",
    ),
    "  a: {run: {package: p, executable: e}, params: {tf_broadcast: true}, node: {preset: amcl}}\n": (  # noqa: E501 (a text as its reader has it)
        "TF330",
        "a map odom slam",
        "tf_broadcast: false",
    ),
    "  a: {run: {package: p, executable: e}, node: {preset: amcl}, params: {global_frame_id: mpa}}\n": (  # noqa: E501 (a text as its reader has it)
        "TF333",
        "global_frame_id a 'mpa' 'map'",
        "remove",
    ),
    "  a: {run: {package: p, executable: e}, node: {preset: amlc}}\n": ("TF601", "amlc", "amcl"),
    "  a: {external: true, node: {preset: apriltag}}\n": (
        "TF331",
        "a * tag*:*",
        'guard: {allow: [{child: "tag*:*"}]}',
    ),
}


@pytest.mark.parametrize("more", FINDINGS)
def test_an_unsettled_claim_is_one_finding_with_the_exact_switch(more: str) -> None:
    (finding,) = compiled(more).findings
    code, names, switch = FINDINGS[more]
    assert finding.code == code
    assert set(names.split()) <= words(finding)
    assert switch in finding.help


@pytest.mark.parametrize(
    "more",
    [
        (
            "  a: {external: true, node: {preset: amcl}, params: {tf_broadcast: false}, after:"
            " {slam: ready}}\n"
        ),
        (
            "  a: {external: true, node: {preset: apriltag}}\nguard: {allow: [{child:"
            " 'tag36h11:*'}]}\n"
        ),
        "  a: {external: true, node: {preset: navsat_transform}, after: {ekf: ready}}\n",
        "  a: {run: {package: p, executable: e}, node: {preset: mavros_local_position}}\n",
    ],
)
def test_what_is_switched_off_or_allowed_is_no_finding(more: str) -> None:
    done = compiled(more)
    assert [line for line in output(done) if not line.startswith("TF815")] == []


def test_an_owner_configured_not_to_publish_is_a_finding_at_the_parameter() -> None:
    done = compiled(**{"node: {preset: ekf}": "node: {preset: ekf}, params: {publish_tf: false}"})
    (finding,) = done.findings
    assert finding.code == "TF333"
    assert {"ekf", "odom", "base_link", "publish_tf"} <= words(finding)


def test_an_edge_that_no_node_of_its_owner_publishes_is_a_finding() -> None:
    done = compiled(**{"owner: ekf": "owner: slam"})
    (finding,) = [entry for entry in done.findings if entry.code == "TF332"]
    assert {"slam", "odom", "base_link"} <= words(finding)


def test_the_plan_knows_what_stops_a_node() -> None:
    plan = read_plan(files_of(compiled(CONTROL, ros=PREFIXED))["plan.json"], "plan.json")
    claim = plan.claim_on(("/r1/diff",), "r1/odom", "r1/base_link")
    assert claim
    assert claim.switch == "enable_odom_tf: false"
    assert plan.claim_on(("/r1/ekf",), "r1/odom", "r1/base_link") is None


@pytest.mark.parametrize("name", node_preset_names())
def test_each_preset_is_sound_and_names_its_source(name: str) -> None:
    preset = node_preset(name)
    assert preset.source
    for fact in preset.source:
        assert len(fact.commit) == 40
    roles = set(preset.frames)
    for claim in preset.publishes:
        used = {
            word.strip("{}")
            for end in (claim.parent, claim.child)
            for word in end.split("_")[:1]
            if "{" in word
        }
        assert used <= roles
        assert claim.by_default or claim.on or not claim.off


FACTS: dict[str, dict[str, Any]] = {
    "diff_drive_controller": {"odom_frame_id": "odom", "base_frame_id": "base_link"},
    "tricycle_controller": {"odom_frame_id": "odom", "base_frame_id": "base_link"},
    "mecanum_drive_controller": {"odom_frame_id": "odom", "base_frame_id": "base_link"},
    "ekf": {"map_frame": "map", "odom_frame": "odom", "base_link_frame": "base_link"},
    "amcl": {"global_frame_id": "map", "odom_frame_id": "odom", "base_frame_id": "base_footprint"},
    "slam_toolbox": {"map_frame": "map", "odom_frame": "odom", "base_frame": "base_footprint"},
    "rtabmap": {"map_frame_id": "map", "frame_id": "base_link"},
    "mavros": {"map_frame_id": "map", "odom_frame_id": "odom", "base_link_frame_id": "base_link"},
    "create3": {},
    "cartographer": {},
}


@pytest.mark.parametrize("name", FACTS)
def test_the_frames_parameters_and_their_defaults_are_the_vendors(name: str) -> None:
    roles = node_preset(name).frames.values()
    assert {role.parameter: role.default for role in roles if role.parameter} == FACTS[name]


def test_a_switch_that_the_user_sets_is_not_overwritten_silently() -> None:
    text = (
        "tfcompose: 1\nrobot: r\nframes: {odom: {}, base_link: {parent: odom, owner:"
        " ekf}}\nprocesses:\n  ekf: {external: true}\n  drive:\n    run: RUN\n    params: {tf:"
        " true}\n    publishes: [{parent: odom, child: base_link, off: {tf: false}}]\n"
    )
    (finding,) = compile_robot(
        text.replace("RUN", "{package: p, executable: e}"), "r.yaml", library()
    ).findings
    assert finding.code == "TF333"
    assert {"tf", "drive", "ekf", "odom", "base_link"} <= words(finding)


def test_a_switch_is_a_parameter_for_a_command_that_takes_the_file() -> None:
    text = (
        "tfcompose: 1\nrobot: r\nframes: {odom: {}, base_link: {parent: odom, owner:"
        " ekf}}\nprocesses:\n  ekf: {external: true}\n  drive: {run: [mine, '${params_file}'],"
        " publishes: [{parent: odom, child: base_link, off: {tf: false}}]}\n"
    )
    compiled = compile_robot(text, "r.yaml", library())
    assert not compiled.findings
    assert compiled.robot
    assert {file.path: file.text for file in emit(compiled.robot)}["params/drive.yaml"].endswith(
        '"tf": false\n'
    )
