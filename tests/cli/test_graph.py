"""``tfcompose graph``: endings choose the format; what cannot be drawn is reported."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "robots" / "two_rovers.yaml"
BEGIN = {
    "svg": b"<svg ",
    "png": b"\x89PNG",
    "dot": b"digraph ",
    "mmd": b"flowchart LR",
}


def graph(*words: object, cwd: Path, without: str = "") -> subprocess.CompletedProcess[str]:
    """Run the command, ``without`` a package in a process of its own."""
    if not without:
        return tfcompose_in(cwd, "graph", *words)
    program = (
        f"import sys; sys.modules[{without!r}] = None; from tfcompose.cli import main; raise"
        f" SystemExit(main({['graph', *map(str, words)]!r}))"
    )
    return processes.run([sys.executable, "-c", program], cwd=cwd)


@pytest.mark.parametrize("ending", BEGIN)
def test_the_suffix_decides_the_format(ending: str, tmp_path: Path) -> None:
    done = graph(ROBOT, "-o", f"out.{ending.upper()}", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"wrote out.{ending.upper()}\n", "")
    (saved,) = tmp_path.iterdir()
    assert saved.read_bytes().startswith(BEGIN[ending])
    (plain := tmp_path / "plain").touch()
    assert saved.stat().st_mode == plain.stat().st_mode, (
        "as readable as other files of this user's"
    )


def test_without_options_it_writes_what_build_writes(tmp_path: Path) -> None:
    assert graph(ROBOT, cwd=tmp_path).returncode == 0
    golden = ROOT / "tests" / "golden" / "two_rovers" / "tree.svg"
    assert (tmp_path / "tree.svg").read_bytes() == golden.read_bytes()


def test_poses_are_drawn_on_request(tmp_path: Path) -> None:
    for name, options in (("without.svg", ()), ("with.svg", ("--poses",))):
        graph(ROBOT, "-o", name, *options, cwd=tmp_path)
    assert "xyz 0.1 0 0.2<" in (tmp_path / "with.svg").read_text("utf-8")
    assert "xyz 0.1 0 0.2<" not in (tmp_path / "without.svg").read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("tree.jpg", {".jpg", *BEGIN}),
        ("tree", {"tree", *BEGIN}),
        ("tree.pdf", {"PDF", "tree.svg", "browser"}),
        ("no/folder/tree.svg", {"no/folder"}),
    ],
)
def test_what_cannot_be_saved_is_refused_in_one_line(
    name: str, named: set[str], tmp_path: Path
) -> None:
    done = graph(ROBOT, "-o", name, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert named <= set(re.split(r"[ ,;:\n]+", done.stderr))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("package", ["resvg_py", "font_lato"])
def test_without_a_package_only_png_is_refused_and_says_what_to_install(
    package: str, tmp_path: Path
) -> None:
    done = graph(ROBOT, "-o", "tree.png", cwd=tmp_path, without=package)
    assert done.returncode == 2
    assert "pip install 'tfcompose[pictures]'" in done.stderr
    assert graph(ROBOT, "-o", "tree.svg", cwd=tmp_path, without=package).returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["tree.svg"]


def test_a_robot_with_errors_is_not_drawn(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text(
        "tfcompose: 1\nrobot: bad\nframes: {a: {parent: b}}\n", encoding="utf-8"
    )
    done = graph("bad.yaml", cwd=tmp_path)
    assert done.returncode == 1
    assert "error[TF" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["bad.yaml"]


def test_an_earlier_picture_is_replaced_and_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "old.svg").write_text("old", encoding="utf-8")
    (tmp_path / "old.svg").chmod(0o640)
    (tmp_path / "link.svg").symlink_to("target.svg")
    for name in ("old.svg", "link.svg"):
        assert graph(ROBOT, "-o", name, cwd=tmp_path).returncode == 0
    assert (tmp_path / "old.svg").read_text("utf-8").startswith("<svg ")
    assert (tmp_path / "old.svg").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "link.svg").is_symlink()
    assert (tmp_path / "target.svg").read_text("utf-8").startswith("<svg ")
