"""What ``tfcompose presets`` says of nodes is what the presets say."""

import json

import pytest

from tfcompose.cli.parser import main
from tfcompose.cli.preset_page import node_facts, node_text
from tfcompose.compiler.resolve.presets import node_preset, node_preset_names


@pytest.mark.parametrize("name", node_preset_names())
def test_a_page_names_each_edge_its_switch_and_each_parameter(name: str) -> None:
    page, preset = node_text(node_facts(name)), node_preset(name)
    for claim in node_facts(name)["publishes"]:
        assert f"{claim['parent']} → {claim['child']}" in page
        assert all(f"{key}: " in page for key in claim["off"])
        assert "{" not in claim["parent"] + claim["child"]
    assert all(role.parameter in page for role in preset.frames.values() if role.parameter)
    assert preset.source[0].commit in page


def test_nodes_are_listed_with_the_sensors_and_by_package(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["presets", "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert set(node_preset_names()) <= {row["name"] for row in rows if row["kind"] == "node"}
    assert main(["presets", "robot_localization"]) == 0
    listed = capsys.readouterr().out
    assert "  ekf " in listed
    assert "slam_toolbox" not in listed
    assert main(["presets", "ekf"]) == 0
    assert (
        "map → odom  /tf, with world_frame: map, off: publish_tf: false" in capsys.readouterr().out
    )
    assert main(["presets", "efk"]) == 1
    assert "did you mean ekf?" in capsys.readouterr().err
