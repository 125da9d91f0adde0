"""The files that a file of a stranger's may read."""

import os
from pathlib import Path

import pytest

from tfcompose.foundation.reach import OutsideError, Reach


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a home with a workspace, and a key."""
    folder = tmp_path / "home"
    for name, text in {
        ".ssh/id": "key",
        "notes.txt": "private",
        "robot.yaml": "robot",
        "work/repository/.git/config": "token",
        "work/repository/pkg/urdf/arm.xacro": "arm",
        "work/repository/pkg/package.xml": "<package><name>pkg</name></package>",
        "work/repository/other/a.yaml": "a",
        "work/elsewhere/b.yaml": "b",
        "work/neighbour/package.xml": "<package><name>neighbour</name></package>",
        "work/neighbour/c.yaml": "c",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    monkeypatch.setenv("HOME", str(folder))
    return folder


def allowed(of: Reach, folder: Path) -> set[str]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)) for path in files if of.allows(str(path))}


def granted(of: Reach, folder: Path) -> set[str]:
    """Return the same as the kernel is told."""
    paths = of.grants().paths
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return {
        str(file.relative_to(folder))
        for file in files
        if any(file == Path(path) or Path(path) in file.parents for path in paths)
    }


def test_a_tree_is_the_repository_without_gits_own_folder(home: Path) -> None:
    of = Reach()
    of.add_tree(str(home / "work/repository/pkg/urdf/arm.xacro"))
    expected = {
        f"work/repository/{name}"
        for name in ("pkg/urdf/arm.xacro", "pkg/package.xml", "other/a.yaml")
    }
    assert allowed(of, home) == granted(of, home) == expected


def test_a_repository_within_a_tree_keeps_its_credentials(home: Path) -> None:
    (home / "work/robot.yaml").write_text("robot", encoding="utf-8")
    of = Reach()
    of.add_tree(str(home / "work/robot.yaml"))
    assert "work/elsewhere/b.yaml" in allowed(of, home) == granted(of, home)
    assert "work/repository/.git/config" not in allowed(of, home) | granted(of, home)


def test_in_the_home_a_tree_is_the_descriptions_next_to_it(home: Path) -> None:
    of = Reach()
    of.add_tree(str(home / "robot.yaml"))
    assert allowed(of, home) == granted(of, home) == {"robot.yaml"}


def test_a_home_that_is_a_repository_is_no_tree(home: Path) -> None:
    (home / ".git").mkdir()
    of = Reach()
    of.add_tree(str(home / "work/elsewhere/b.yaml"))
    assert allowed(of, home) == granted(of, home) == {"work/elsewhere/b.yaml"}


def test_packages_are_added_on_request(home: Path) -> None:
    of = Reach()
    of.add_tree(str(home / "work/repository/pkg/urdf/arm.xacro"))
    of.add_neighbours(str(home / "work/repository/pkg/urdf/arm.xacro"))
    assert "work/neighbour/c.yaml" in allowed(of, home) == granted(of, home)
    assert "work/elsewhere/b.yaml" not in allowed(of, home)


def test_a_package_whose_files_are_links_brings_its_source(home: Path) -> None:
    share = home / "install/share/pkg"
    (share / "urdf").mkdir(parents=True)
    for name in ("package.xml", "urdf/arm.xacro"):
        (share / name).symlink_to(home / "work/repository/pkg" / name)
    for add in ("add_folder", "add_prefix"):
        of = Reach()
        getattr(of, add)(str(share if add == "add_folder" else home / "install"))
        assert of.read(str(share / "urdf/arm.xacro"), 100) == b"arm"
        assert "work/repository/pkg/urdf/arm.xacro" in granted(of, home)
        assert not of.allows(str(home / "work/repository/other/a.yaml"))


def test_links_and_dots_do_not_lead_out(home: Path) -> None:
    folder = home / "work/elsewhere"
    (folder / "link.yaml").symlink_to(home / ".ssh/id")
    (folder / "loop").symlink_to("loop")
    of = Reach()
    of.add_tree(str(folder / "b.yaml"))
    for name in (
        "link.yaml",
        "../../.ssh/id",
        str(home / ".ssh/id"),
        "/etc/passwd",
        "/proc/self/environ",
        "..",
        "a\0b",
    ):
        with pytest.raises(OutsideError):
            of.read(os.path.join(folder, name), 100)  # noqa: PTH118 (of absolute ones, too)
    for name in ("loop", "x" * 300, "gone.yaml", ""):
        with pytest.raises(OSError, match="Errno"):
            of.read(f"{folder}/{name}", 100)
    with pytest.raises(OutsideError):
        of.names_in(str(home))
    assert of.names_in(str(folder)) == ["b.yaml", "link.yaml", "loop"]


def test_only_plain_files_of_bounded_size_are_read(home: Path) -> None:
    folder = home / "work/elsewhere"
    os.mkfifo(folder / "pipe")
    (folder / "large").write_bytes(b"x" * 101)
    of = Reach()
    of.add_tree(str(folder / "b.yaml"))
    for name in ("pipe", "large"):
        with pytest.raises(OSError, match=r"plain|larger"):
            of.read(str(folder / name), 100)


def test_with_trust_all_is_read(home: Path) -> None:
    assert Reach(everything=True).read(str(home / ".ssh/id"), 100) == b"key"
