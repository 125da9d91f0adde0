"""``tfcompose play``: the robot file's fixed edges, latched, while a player plays the rest.

A script stands in for ``ros2 bag play``, which comes with a distribution only.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rosbags.rosbag2 import CompressionMode

from tests.support import processes
from tests.support.bags import write_bag
from tests.support.cli import tfcompose_in
from tests.support.domains import Domain
from tests.support.waiting import TIMEOUT_S, until
from tests.tools.rebag.test_rebag import RECORDED, ROBOT

REMAPPED = ["--remap", "/tf_static:=/tf_static_recorded"]
#: Writes down its arguments, and plays until SIGINT or for no time.
PLAYER = f"""#!{sys.executable}
import json, os, signal, sys
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
open("player.new", "w").write(json.dumps(sys.argv[1:]))
os.replace("player.new", "player.json")
if "--loop" in sys.argv:
    signal.pause()
sys.exit(3)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "ros2").write_text(PLAYER, "utf-8")
    (tmp_path / "bin" / "ros2").chmod(0o755)
    write_bag(tmp_path / "drive", RECORDED, compressed=CompressionMode.MESSAGE)
    return tmp_path


def play(folder: Path, domain: Domain, *options: str) -> subprocess.Popen[str]:
    environment = {**domain.environment, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
    return processes.start(
        [sys.executable, "-m", "tfcompose", "play", "drive", "--with", "cart.yaml", *options],
        cwd=folder,
        env=environment,
    )


def x_of(child: str, folder: Path, domain: Domain) -> float:
    echo = [sys.executable, "-m", "tfcompose", "echo", "base_link", child]
    done = processes.run(
        [*echo, "--once", "--format", "json"], cwd=folder, env=domain.environment, check=True
    )
    x: float = json.loads(done.stdout)["xyz"][0]
    return x


@pytest.mark.ros
def test_fixed_edges_are_latched_while_the_player_runs(folder: Path, domain: Domain) -> None:
    playing = play(folder, domain, "--", "--loop")
    assert until((folder / "player.json").exists)
    command = json.loads((folder / "player.json").read_text("utf-8"))
    assert command == ["bag", "play", "drive", *REMAPPED, "--loop"]
    assert x_of("laser", folder, domain) == 0.24
    assert x_of("tag", folder, domain) == 1.0, "recorded, and not in the file"
    playing.send_signal(signal.SIGTERM)
    assert playing.wait(TIMEOUT_S) == 130


@pytest.mark.ros
def test_the_exit_code_is_the_player_s(folder: Path, domain: Domain) -> None:
    assert play(folder, domain).wait(TIMEOUT_S) == 3


def test_print_starts_nothing_and_names_fixed_edges_on_tf(folder: Path) -> None:
    done = tfcompose_in(folder, "play", "drive", "--with", "cart.yaml", "--print")
    assert done.stdout.split() == ["ros2", "bag", "play", "drive", *REMAPPED]
    assert "warning[TF927]" in done.stderr
    assert "base_link → bracket" in done.stderr
    assert not (folder / "player.json").exists()


@pytest.mark.parametrize(
    ("options", "rules", "remaining"),
    [
        (["--rate", "2", "--remap", "/a:=/b", "/c:=/d"], ["/a:=/b", "/c:=/d"], ["--rate", "2"]),
        (["-m", "/a:=/b", "--loop"], ["/a:=/b"], ["--loop"]),
        (["--remap=/a:=/b", "--topics", "/tf"], ["/a:=/b"], ["--topics", "/tf"]),
    ],
)
def test_remappings_of_the_user_join_those_of_fixed_edges(
    options: list[str], rules: list[str], remaining: list[str], folder: Path
) -> None:
    """Of several --remap, ros2 bag play would take the last."""
    words = ("play", "drive", "--with", "cart.yaml", "--print", "--", *options)
    done = tfcompose_in(folder, *words)
    assert done.stdout.split() == ["ros2", "bag", "play", "drive", *REMAPPED, *rules, *remaining]
