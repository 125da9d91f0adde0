"""Findings repeat nothing of a file that is not about robots, whoever names it.

Their output may be public.
"""

from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in

#: Files that hold a secret.
SECRETS = {
    "environ": "PATH=/bin\0TOKEN=hunter2\0",
    "environment": "TOKEN=hunter2\n",
    "passwd": "hunter2:x:0:0:root:/root:/bin/bash\n",
    "shadow": "root:hunter2:20228:0:99999:7:::\nhunter2:*:2:::\n",
    "yaml": "password: hunter2\nhunter2: {a: 1}\nhosts: [hunter2]\n",
    "gh": "github.com:\n    user: hunter2\n    oauth_token: hunter2\n",
    "anchor": "*hunter2\n",
    "tag": "!hunter2 x\n",
    "alias": "a: *hunter2\nhunter2: hunter2\n",
    "line": "hunter2\n",
    "lines": "a\nhunter2: x\n",
    "json": '{"auths": {"registry": "hunter2"}, "hunter2": 1}',
    "list": "- hunter2\n- {hunter2: 1}\n",
    "xml": "<settings><hunter2/><password>hunter2</password></settings>",
    "broken xml": "<settings hunter2><password>",
    "latin-1": "TOKEN=hunter2\xe4\n",
    "numbers": "hunter2 1 2 3\n4 5 6 7\n",
    "netrc": "machine github.com login me password hunter2\n",
    "key": "-----BEGIN OPENSSH PRIVATE KEY-----\nhunter2\n",
    "git": '[http "https://github.com/"]\n\textraheader = AUTHORIZATION: basic hunter2\n',
}
#: How a robot file names another one.
NAMING = {
    "include": "include: [{}]",
    "calibrations": "calibrations: [{}]",
    "calibration": "frames: {{eye: {{parent: base_link, calibration: {{file: {}}}}}}}",
    "part": "parts: {{a: {{spec: {}, parent: base_link}}}}",
    "urdf": "parts: {{a: {{urdf: {}, parent: base_link}}}}",
    "xacro": "parts: {{a: {{xacro: {}, parent: base_link}}}}",
    "fleet": "fleet: {}",
    "mesh": "frames: {{}}\nxml: []\npackages: {{p: {}}}",
    "params": "processes: {{a: {{run: {{package: a, executable: b}}, params: {}}}}}",
    "preset path": "preset_path: {}",
}
ROBOT = "tfcompose: 1\nrobot: r\nlinks: {{base_link: {{}}}}\n{}\n"


@pytest.mark.parametrize("kind", SECRETS)
@pytest.mark.parametrize("naming", NAMING)
def test_a_finding_shows_nothing_of_a_file_that_is_no_robots(
    kind: str, naming: str, tmp_path: Path
) -> None:
    (tmp_path / "secret").write_bytes(SECRETS[kind].encode("latin-1"))
    (tmp_path / "robot.yaml").write_text(ROBOT.format(NAMING[naming].format("secret")), "utf-8")
    for form in ("text", "github", "json"):
        done = tfcompose_in(tmp_path, "lint", "robot.yaml", "--format", form)
        assert "hunter2" not in done.stdout + done.stderr, done.stdout
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("kind", SECRETS)
def test_no_line_of_a_file_in_the_robot_files_place_is_shown(kind: str, tmp_path: Path) -> None:
    """As where a link of that name is in a pull request.

    What it holds may be named in a message.
    """
    (tmp_path / "secret").write_bytes(SECRETS[kind].encode("latin-1"))
    (tmp_path / "robot.yaml").unlink(missing_ok=True)
    (tmp_path / "robot.yaml").symlink_to("secret")
    done = tfcompose_in(tmp_path, "lint", "robot.yaml")
    assert done.returncode in {1, 2}
    assert " | " not in done.stdout


@pytest.mark.parametrize("name", ["robot.yaml", "more.yaml", "part.urdf"])
def test_lines_of_a_robots_own_files_are_shown(name: str, tmp_path: Path) -> None:
    robot = "tfcompose: 1\nrobot: r\ninclude: [more.yaml]\nlinks: {base_link: {}}\n"
    robot += "parts: {a: {urdf: part.urdf, parent: base_link}}\n"
    texts = {
        "robot.yaml": robot,
        "more.yaml": "frames: {eye: {parent: base_link}}\n",
        "part.urdf": "<robot name='p'><link name='l'/></robot>\n",
    }
    faults = {"robot.yaml": "lnks: {}\n", "more.yaml": "sensrs: {}\n", "part.urdf": "<x"}
    for file, text in texts.items():
        (tmp_path / file).write_text(text + faults[file] * (file == name), "utf-8")
    done = tfcompose_in(tmp_path, "lint", "robot.yaml")
    assert f"{name}:" in done.stdout
    assert f" | {faults[name].strip()}" in done.stdout


def test_lines_of_a_script_that_is_imported_are_shown(tmp_path: Path) -> None:
    (tmp_path / "up.sh").write_text('exec x "$(pwd)/hunter2"\n', "utf-8")
    assert ' | exec x "$(pwd)/hunter2"' in tfcompose_in(tmp_path, "import", "up.sh").stderr
