"""Runtime directories: private folders, and a lock that ends with its holder."""

import fcntl
import os
import re
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.support import processes
from tests.support.waiting import until
from tfcompose.launcher import runtime_dir
from tfcompose.launcher.runtime_dir import (
    Holder,
    Lock,
    RuntimeDirError,
    runtime_dir_of,
    runtime_dirs,
)
from tfcompose.model.plan import Plan, RosSettings

ROVER = Plan("rover", "", None, RosSettings(domain_id=7), (), ())
HOLD = """
import os, sys
from pathlib import Path
from tfcompose.launcher import runtime_dir
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir
lock = Lock(RuntimeDir("rover@7", Path(sys.argv[1]), Path(sys.argv[1])))
print(lock.run, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def env(tmp_path: Path) -> dict[str, str]:
    folder = tmp_path / "runtime"
    folder.mkdir(mode=0o700)
    return {
        "XDG_RUNTIME_DIR": str(folder),
        "ROS_LOG_DIR": str(tmp_path / "log"),
        "ROS_DOMAIN_ID": "3",
    }


def test_a_robot_is_its_name_in_the_domain_of_its_plan_or_environment(
    env: dict[str, str],
) -> None:
    runtime_dir = runtime_dir_of(ROVER, env)
    assert (runtime_dir.name, runtime_dir.folder.parent.stat().st_mode & 0o777) == (
        "rover@7",
        0o700,
    )
    assert runtime_dir.logs == runtime_dir_of(ROVER, env).logs
    assert str(runtime_dir.logs) == f"{env['ROS_LOG_DIR']}/tfcompose/rover@7"
    assert runtime_dir_of(Plan("rover", "", None, RosSettings(), (), ()), env).name == "rover@3"
    assert (
        runtime_dir_of(
            Plan("rover", "", None, RosSettings(), (), ()), env | {"ROS_DOMAIN_ID": ""}
        ).name
        == "rover@0"
    )


@pytest.mark.parametrize("variable", ["", "relative", "/nowhere", "shared"])
def test_without_a_safe_runtime_folder_one_of_the_users_own_is_made(
    variable: str, env: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "shared").mkdir(mode=0o777)
    (tmp_path / "shared").chmod(0o777)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(runtime_dir, "USERS", tmp_path / "nobody")
    rover = runtime_dir_of(
        ROVER,
        env | {"XDG_RUNTIME_DIR": str(tmp_path / variable) if variable == "shared" else variable},
    )
    assert rover.folder.parent == tmp_path / f"tfcompose-{os.getuid()}"
    assert rover.folder.parent.stat().st_mode & 0o777 == 0o700


def test_who_does_not_name_the_users_folder_uses_it_too(
    env: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a service does, or cron: so that ``ps`` in a terminal sees what was started there."""
    monkeypatch.setattr(runtime_dir, "USERS", tmp_path)
    (tmp_path / str(os.getuid())).mkdir(mode=0o700)
    in_session = runtime_dir_of(ROVER, env | {"XDG_RUNTIME_DIR": str(tmp_path / str(os.getuid()))})
    del env["XDG_RUNTIME_DIR"]
    assert runtime_dir_of(ROVER, env) == in_session


@pytest.mark.parametrize("how", ["open to all", "a link"])
def test_a_folder_that_somebody_else_may_have_prepared_is_refused(
    how: str, env: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(runtime_dir, "USERS", tmp_path / "nobody")
    folder = tmp_path / f"tfcompose-{os.getuid()}"
    if how == "a link":
        (tmp_path / "trap").mkdir(mode=0o700)
        folder.symlink_to(tmp_path / "trap")
    else:
        folder.mkdir()
        folder.chmod(0o755)
    with pytest.raises(RuntimeDirError, match=re.escape(str(folder))):
        runtime_dir_of(ROVER, env | {"XDG_RUNTIME_DIR": ""})


def test_one_of_two_gets_the_lock_and_a_killed_holder_leaves_nothing(
    env: dict[str, str],
) -> None:
    runtime_dir = runtime_dir_of(ROVER, env)
    command = [sys.executable, "-c", HOLD, str(runtime_dir.folder)]
    with processes.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holding:
        assert holding.stdout
        run = holding.stdout.readline().strip()
        with pytest.raises(BlockingIOError):
            Lock(runtime_dir)
        holder = runtime_dir.holder()
        assert holder
        assert (holder.pid, holder.run) == (holding.pid, run)
        assert [listed.name for listed in runtime_dirs(env)] == ["rover@7"]
        holding.kill()
    assert runtime_dir.holder() is None
    lock = Lock(runtime_dir)
    assert lock.run != run
    lock.close()


def test_who_only_observes_is_in_nobodys_way_and_is_taken_for_nobodys_run(
    env: dict[str, str],
) -> None:
    runtime_dir = runtime_dir_of(ROVER, env)
    Lock(runtime_dir).close()
    with (runtime_dir.folder / "lock").open() as looker:
        fcntl.flock(
            looker, fcntl.LOCK_SH
        )  # as holder does for a moment; this one is kept from going on
        assert runtime_dir.holder() is None, "of two who look, each took the other for a run"
        threading.Timer(0.2, fcntl.flock, (looker, fcntl.LOCK_UN)).start()
        lock = Lock(runtime_dir)
    assert runtime_dir.holder()
    lock.close()


def test_a_child_that_is_started_does_not_hold_the_lock_on(env: dict[str, str]) -> None:
    runtime_dir = runtime_dir_of(ROVER, env)
    lock = Lock(runtime_dir)
    with processes.start(["/bin/sleep", "60"], close_fds=False) as child:
        lock.close()
        try:
            # The kernel gives the parent its turn a moment before it closes what the child must
            # not have.
            assert until(lambda: runtime_dir.holder() is None)
        finally:
            child.kill()


def test_a_run_is_found_though_what_its_lock_holds_cannot_be_read(
    env: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    place = runtime_dir_of(ROVER, env)
    lock = Lock(place)
    os.ftruncate(lock.fd, 0)
    monkeypatch.setattr(runtime_dir, "time", SimpleNamespace(sleep=lambda _: None))
    assert place.holder() == Holder(0, 0.0, "")
    lock.close()
