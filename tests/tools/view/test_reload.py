"""Files that change on disk are shown again; a broken one leaves the last good scene."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh

from tests.support.browser import TOKEN
from tests.support.scenes import is_owner_shown
from tests.support.waiting import until
from tfcompose.cli.parser import parser_of
from tfcompose.cli.reading import read_text
from tfcompose.foundation.geometry import Pose
from tfcompose.tools.view.reload import ReloadedPanel, WatchedFiles, Watcher
from tfcompose.tools.view.server import start_server, stop_server
from tfcompose.tools.view.view_session import session_of

TEXT = """tfcompose: 1
robot: r
include: [more.yaml]
links: {base_link: {}, arm: {}}
joints: {j: {type: continuous, parent: base_link, child: arm, xyz: [0, 0, 1], axis: [0, 0, 1]}}
frames: {tool: {parent: arm, xyz: [1, 0, 0]}}
"""
BROKEN = {
    "no YAML": "tfcompose: [1\n",
    "an unknown key": TEXT.replace("links:", "lnks:"),
    "no frames": "tfcompose: 1\nrobot: r\n",
    "empty": "",
}


@pytest.fixture
def reloaded(tmp_path: Path) -> Iterator[ReloadedPanel]:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    (tmp_path / "more.yaml").write_text(
        "frames: {mast: {parent: base_link, xyz: [0, 0, 2]}}\n", "utf-8"
    )
    files = WatchedFiles(read_text)
    session = session_of(
        str(tmp_path / "r.yaml"), parser_of("view").parse_args([str(tmp_path / "r.yaml")]), files
    )
    server = start_server("127.0.0.1", 0, "test", TOKEN)
    yield ReloadedPanel(server, session, files, edit=True, joints=True)
    stop_server(server)


def reload(reloaded: ReloadedPanel) -> bool:
    """Read the files again; return whether the panel is a new one."""
    return reloaded.files.differ() and reloaded.accept(
        *reloaded.session.read_again(reloaded.files)
    )


def replace(path: Path, text: str) -> None:
    """Replace a file as editors do."""
    new = path.with_suffix(".new")
    new.write_text(text, "utf-8")
    new.replace(path)


def test_a_changed_file_is_shown_and_what_the_user_chose_stays(
    reloaded: ReloadedPanel, tmp_path: Path
) -> None:
    reloaded.panel.tree.select("tool")
    reloaded.panel.set_joint("j", 0.5)
    replace(
        tmp_path / "r.yaml",
        TEXT.replace("[1, 0, 0]}}", "[1, 0, 0]}, hook: {parent: tool, xyz: [0, 0, 1]}}"),
    )
    assert reload(reloaded)
    assert "hook" in reloaded.panel.poses()
    assert reloaded.panel.selected == "tool"
    assert reloaded.panel.positions == {"j": 0.5}
    assert not reload(reloaded)


def test_hidden_open_and_selected_items_survive_reloads(
    reloaded: ReloadedPanel, tmp_path: Path
) -> None:
    for owner in ("joints", "nobody"):
        reloaded.panel.choices.owners[owner] = False
    reloaded.panel.choices.is_open["arm"] = False
    reloaded.panel.choices.base = "mast"
    reloaded.panel.tree.show("arm", is_visible=False)
    reloaded.panel.tree.select("mast")
    reloaded.panel.tree.search("a")
    replace(
        tmp_path / "r.yaml", TEXT.replace("tool:", "hook: {parent: arm, xyz: [0, 1, 0]}, tool:")
    )
    assert reload(reloaded)
    assert reloaded.panel.tree.hidden == {"arm", "tool", "hook"}
    assert reloaded.panel.selected == "mast"
    assert reloaded.panel.choices.base == "mast"
    assert reloaded.panel.choices.search == "a"
    assert not reloaded.panel.tree.tree.is_open("arm", reloaded.panel.choices.is_open)
    assert not is_owner_shown(reloaded.panel.scene, "joints")
    assert is_owner_shown(reloaded.panel.scene, "static")
    (tmp_path / "more.yaml").write_text("{}\n", "utf-8")
    assert reload(reloaded)
    assert reloaded.panel.selected == "base_link"
    assert reloaded.panel.tree.hidden == {"arm", "tool", "hook"}


def test_an_included_file_is_one_of_the_robots(reloaded: ReloadedPanel, tmp_path: Path) -> None:
    replace(tmp_path / "more.yaml", "frames: {mast: {parent: base_link, xyz: [0, 0, 3]}}\n")
    assert reload(reloaded)
    assert reloaded.panel.poses()["mast"].xyz == (0, 0, 3)


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_leaves_the_last_good_scene_and_is_found_wrong(
    name: str, reloaded: ReloadedPanel, tmp_path: Path
) -> None:
    before, panel = reloaded.panel.poses(), reloaded.panel
    replace(tmp_path / "r.yaml", BROKEN[name])
    assert not reload(reloaded)
    assert reloaded.panel is panel
    assert reloaded.panel.poses() == before
    assert "TF" in reloaded.report
    replace(tmp_path / "r.yaml", TEXT.replace("[1, 0, 0]}}", "[2, 0, 0]}}"))
    assert reload(reloaded)
    assert not reloaded.report


def test_a_file_that_is_gone_leaves_the_scene(reloaded: ReloadedPanel, tmp_path: Path) -> None:
    (tmp_path / "r.yaml").unlink()
    assert not reload(reloaded)
    assert reloaded.report


def test_a_mesh_that_is_changed_is_read_again(reloaded: ReloadedPanel, tmp_path: Path) -> None:
    for number, radius in enumerate((1.0, 2.0)):
        trimesh.creation.icosphere(subdivisions=1, radius=radius).export(tmp_path / "tip.stl")
        if number == 0:
            replace(tmp_path / "r.yaml", TEXT.replace("arm: {}", "arm: {visual: {mesh: tip.stl}}"))
        until(lambda: reload(reloaded))
        least, most = reloaded.panel.scene.bounds("arm")
        assert [*least, *most] == pytest.approx([-radius] * 3 + [radius] * 3, rel=0.2)
    assert not reload(reloaded)


def test_a_preset_of_the_robot_that_is_changed_is_read_again(
    reloaded: ReloadedPanel, tmp_path: Path
) -> None:
    preset = tmp_path / "presets" / "own" / "eye.yaml"
    preset.parent.mkdir(parents=True)
    text = "preset: 1\nvendor: Own\nmodel: Eye\nkind: imu\nabout: an eye\nmount: '{name}'\n"
    text += "frames: {'{name}_lens': {parent: '{name}', xyz: [%d, 0, 0]}}\n"
    preset.write_text(text % 1, "utf-8")
    sensor = (
        "preset_path: presets\nsensors: {e: {preset: own/eye, parent: base_link, xyz: [1, 0,"
        " 0]}}\n"
    )
    replace(tmp_path / "r.yaml", TEXT + sensor)
    assert reload(reloaded), reloaded.report
    for x in (2, 3):
        replace(preset, text % x)
        assert reload(reloaded), reloaded.report
        edge = reloaded.session.robot.parent_edge("e_lens")
        assert edge
        assert edge.pose.xyz == (x, 0, 0)
    assert not reload(reloaded)


def test_a_save_is_no_change_on_disk(reloaded: ReloadedPanel) -> None:
    reloaded.panel.tree.select("tool")
    reloaded.panel.move(Pose((3, 0, 0)))
    reloaded.panel.save()
    assert "saved" in reloaded.panel.report.content
    assert not reload(reloaded)


def test_moves_of_frames_that_stay_are_kept(reloaded: ReloadedPanel, tmp_path: Path) -> None:
    reloaded.session.move("tool", Pose((3, 0, 0)))
    reloaded.session.move("mast", Pose((4, 0, 0)))
    replace(tmp_path / "more.yaml", "{}\n")
    assert reload(reloaded)
    assert reloaded.session.moved == {"tool": Pose((3, 0, 0))}


def test_the_watcher_reports_changes_of_all_files_including_later_ones(
    reloaded: ReloadedPanel, tmp_path: Path
) -> None:
    (tmp_path / "sub").mkdir()
    with Watcher(reloaded.files) as watcher:
        (tmp_path / "other.txt").write_text("x", "utf-8")
        replace(tmp_path / "r.yaml", TEXT.replace("more.yaml", "sub/more.yaml"))
        assert until(watcher.changed.is_set)
        watcher.changed.clear()
        assert not reload(reloaded)
        replace(
            tmp_path / "sub" / "more.yaml", "frames: {mast: {parent: base_link, xyz: [0, 0, 5]}}\n"
        )
        assert until(watcher.changed.is_set)
        assert until(lambda: reload(reloaded))
    assert reloaded.panel.poses()["mast"].xyz == (0, 0, 5)


def test_a_robot_wrong_from_the_start_is_shown_again_while_it_is_wrong(
    tmp_path: Path,
) -> None:
    wrong = TEXT.replace("parent: arm,", "parent: amr,").replace("include: [more.yaml]\n", "")
    file = tmp_path / "r.yaml"
    file.write_text(wrong, "utf-8")
    files = WatchedFiles(read_text)
    session = session_of(str(file), parser_of("view").parse_args([str(file)]), files)
    server = start_server("127.0.0.1", 0, "test", TOKEN)
    try:
        reloaded = ReloadedPanel(server, session, files, edit=False, joints=False)
        replace(file, wrong.replace("[0, 0, 1], axis", "[0, 0, 2], axis"))
        assert reload(reloaded)
        assert reloaded.panel.poses()["arm"].xyz == (0, 0, 2)
        assert "TF" in reloaded.report
    finally:
        stop_server(server)
