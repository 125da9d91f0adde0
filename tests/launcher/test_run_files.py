"""A run's files come back when somebody removes them, as logind does at a logout."""

import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, until
from tfcompose.launcher import runtime_dir
from tfcompose.launcher.control import ask, connect
from tfcompose.launcher.leftovers import end, leftovers
from tfcompose.launcher.run_files import RunFiles
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir, goes_with_logout, user_name
from tfcompose.launcher.supervisor import FILES_CHECK_S
from tfcompose.model.messages import Done, DownRequest, RobotStatus, StatusRequest
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.model.plan.file import write_plan


@pytest.fixture
def rover_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RuntimeDir:
    """The directory of a run that has not begun, below a user's folder."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return RuntimeDir("rover@0", tmp_path / "user" / "tfcompose" / "rover@0", tmp_path / "log")


@pytest.fixture
def files(rover_dir: RuntimeDir) -> Iterator[RunFiles]:
    """The files of a run, with a plan and a description."""
    lock = Lock(rover_dir)
    plan_file = rover_dir.plan_folder("1") / "plan.json"
    (plan_file.parent / "arm").mkdir(parents=True)
    plan_file.write_bytes(b"the plan")
    (plan_file.parent / "arm" / "robot.urdf").write_bytes(b"the arm")
    files = RunFiles(rover_dir, lock, plan_file)
    yield files
    files.listener.close()
    lock.close()


def restored(files: RunFiles) -> bool:
    """Put back what is missing, as the launcher does, which closes the socket before."""
    before = files.listener
    is_restored = files.restore()
    if files.listener is not before:
        before.close()
    return is_restored


def remove_at_once(folder: Path) -> None:
    """Remove a folder, also while a launcher writes its files again."""
    gone = folder.rename(folder.with_name(f"{folder.name}-gone"))
    shutil.rmtree(gone)


def are_complete(files: RunFiles, runtime_dir: RuntimeDir) -> bool:
    """Return whether commands find the run there: its holder, its socket, and the plan."""
    holder = runtime_dir.holder()
    connect(runtime_dir).close()
    folder = files.plan_file.parent
    return (
        holder is not None
        and (holder.pid, holder.run) == (os.getpid(), files.run_id)
        and files.plan_file.is_relative_to(runtime_dir.folder)
        and files.plan_file.read_bytes() == b"the plan"
        and (folder / "arm" / "robot.urdf").read_bytes() == b"the arm"
    )


REMOVED = ["user", "user/tfcompose", "user/tfcompose/rover@0"] + [
    f"user/tfcompose/rover@0/{name}"
    for name in ("lock", "control", "plan-1", "plan-1/plan.json", "plan-1/arm")
]


@pytest.mark.parametrize("name", REMOVED)
def test_what_is_removed_comes_back(
    name: str, files: RunFiles, rover_dir: RuntimeDir, tmp_path: Path
) -> None:
    before = rover_dir.holder()
    assert not restored(files)
    path = tmp_path / name
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert restored(files)
    assert are_complete(files, rover_dir)
    assert rover_dir.holder() == before
    assert not restored(files)
    if path.is_dir():
        assert path.stat().st_mode & 0o077 == 0


def test_files_are_elsewhere_until_their_folder_can_be_made(
    files: RunFiles, rover_dir: RuntimeDir, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the system makes ``/run/user/UID``; commands without one look where the files are."""
    monkeypatch.setattr(runtime_dir, "USERS", tmp_path)
    shutil.rmtree(tmp_path / "user")
    assert restored(files)
    assert not (tmp_path / "user").exists()
    plan = Plan("rover", "", None, RosSettings(), (), ())
    elsewhere = runtime_dir.runtime_dir_of(plan, {"XDG_RUNTIME_DIR": str(tmp_path / "user")})
    assert elsewhere.folder.is_relative_to(tmp_path / "temporary")
    assert are_complete(files, elsewhere)
    assert not restored(files)
    shutil.rmtree(elsewhere.folder)
    assert restored(files)
    assert are_complete(files, elsewhere)
    (tmp_path / "user").mkdir(mode=0o700)
    assert restored(files)
    assert are_complete(files, rover_dir)
    assert not elsewhere.folder.exists()


def test_a_folder_that_another_user_can_open_is_not_used(
    files: RunFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runtime_dir, "USERS", tmp_path)
    shutil.rmtree(tmp_path / "user")
    folder = tmp_path / "temporary" / f"tfcompose-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(PermissionError):
        restored(files)


def test_the_link_names_the_plan_that_runs_and_comes_back(
    files: RunFiles, rover_dir: RuntimeDir
) -> None:
    refused = rover_dir.plan_folder("3")
    refused.mkdir()
    assert rover_dir.linked_plan() == rover_dir.plan_folder("1")
    files.keep(rover_dir.plan_folder("2") / "plan.json")
    assert rover_dir.linked_plan() == rover_dir.plan_folder("2")
    (rover_dir.folder / "running").unlink()
    assert restored(files)
    assert rover_dir.linked_plan() == rover_dir.plan_folder("2")


def test_another_plan_is_kept_from_then_on(files: RunFiles, rover_dir: RuntimeDir) -> None:
    second_plan = rover_dir.plan_folder("2") / "plan.json"
    second_plan.parent.mkdir()
    second_plan.write_bytes(b"another plan")
    files.keep(second_plan)
    shutil.rmtree(rover_dir.folder)
    assert restored(files)
    assert second_plan.read_bytes() == b"another plan"
    assert rover_dir.plan_folders() == [second_plan.parent]


@pytest.mark.parametrize(
    ("facts", "expected"),
    [
        ({"logged in", "below"}, True),
        ({"logged in", "below", "lingers"}, False),
        ({"below"}, False),
        ({"logged in"}, False),
    ],
)
def test_a_folder_goes_with_the_logout_of_a_user_who_does_not_linger(
    facts: set[str], *, expected: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("LOGGED_IN", "LINGERING", "USERS"):
        monkeypatch.setattr(runtime_dir, name, tmp_path / name)
        (tmp_path / name).mkdir()
    number = str(os.getuid())
    if "logged in" in facts:
        (tmp_path / "LOGGED_IN" / number).touch()
    if "lingers" in facts:
        (tmp_path / "LINGERING" / user_name()).touch()
    above = tmp_path / ("USERS" if "below" in facts else "elsewhere")
    rover = RuntimeDir("rover@0", above / number / "tfcompose" / "rover@0", tmp_path)
    assert goes_with_logout(rover) is expected


LAUNCHER = """
import sys
from pathlib import Path
from tfcompose.cli.console import Console
from tfcompose.launcher.output import NonBlockingOutput
from tfcompose.launcher.run_files import RunFiles
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir
from tfcompose.launcher.supervisor import RunSession, supervise
from tfcompose.model.plan.file import read_plan
name, folder, file = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
place = RuntimeDir(name, folder, folder.parent)
session = RunSession(file, RunFiles(place, Lock(place), file), output=NonBlockingOutput(1))
plan = read_plan(file.read_text(), str(file))
report = Console(plan, session.output, colour=False)
sys.exit(supervise(plan, file, report=report, session=session))
"""
#: Ends at once without the plan.
READER = "import sys, time; print(len(open(sys.argv[1]).read()), flush=True); time.sleep(180)"


def test_a_robot_whose_folder_was_removed_is_found_steered_and_repaired(tmp_path: Path) -> None:
    name = f"rover{os.getpid()}@0"
    runtime_dir = RuntimeDir(name, tmp_path / "user" / "tfcompose" / name, tmp_path)
    argv = (sys.executable, "-I", "-S", "-c", READER, "${plan}")
    reader = PlanProcess("reader", "run", argv, restart="on-failure", restart_delay=0.01)
    file = runtime_dir.plan_folder("1") / "plan.json"
    file.parent.mkdir(parents=True)
    file.write_text(write_plan(Plan("rover", "", None, RosSettings(), (), (reader,))))
    command = [sys.executable, "-c", LAUNCHER, name, str(runtime_dir.folder), str(file)]
    launcher = processes.start(command)

    def pid_of_reader() -> int | None:
        try:
            (process,) = ask(runtime_dir, StatusRequest(), RobotStatus).processes
        except OSError:
            return None
        return process.pid if process.state == "running" else None

    def is_another(earlier_pids: set[int | None]) -> bool:
        return pid_of_reader() not in earlier_pids

    try:
        assert until(partial(is_another, {None}))
        for _ in range(2):
            before = pid_of_reader()
            assert before
            remove_at_once(tmp_path / "user")
            os.kill(before, signal.SIGKILL)
            pids_before = {None, before}
            assert until(partial(is_another, pids_before))
            assert ask(runtime_dir, StatusRequest(), RobotStatus).processes[0].restarts <= 2
        remove_at_once(tmp_path / "user")
        assert until(partial(is_another, {None})), "without the start of a process, too"
        assert FILES_CHECK_S < 1
        assert ask(runtime_dir, DownRequest(), Done).ok
        assert launcher.wait(TIMEOUT_S) == 0
    finally:
        processes.end(launcher)
        assert until(lambda: not end(leftovers(f"{name}:")))
