"""What the agent does on a host, with the files of one: no ssh, and no systemd."""

import base64
import json
import os
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.user_files import write_namesakes
from tests.support.waiting import until
from tfcompose import __version__
from tfcompose.launcher.program import ANYWHERE
from tfcompose.model.plan import Plan, RosSettings
from tfcompose.model.systemd import SOURCING
from tfcompose.tools.deploy.agent import KEPT, UNIT, Agent, HostError
from tfcompose.tools.deploy.connection import START, Settings, agent_command, agent_input
from tfcompose.tools.deploy.release import Release

SETTINGS = {
    "name": "rover.brain",
    "unit": "tfcompose-rover.brain.service",
    "python": "python3",
    "setup": [],
    "sourcing": SOURCING,
    "program": ANYWHERE,
}


@pytest.fixture
def agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Agent:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    return Agent(SETTINGS | {"system": False}, threading.Event())


def release(text: str, **copies: Path) -> Release:
    plan = Plan("rover", "", None, RosSettings(), (), ())
    return Release(
        plan,
        {"plan.json": text, UNIT: "[Unit]\n"},
        {f"wheels/{name}": file for name, file in copies.items()},
    )


def send(agent: Agent, made: Release, *, wheels: bool = False) -> None:
    for part in made.archive():
        agent.chunk(base64.b64encode(part).decode())
    agent.unpack(made.name, wheels=wheels)


def test_what_is_sent_is_there_with_the_same_digests(agent: Agent) -> None:
    made = release("one")
    send(agent, made)
    assert agent._manifest(made.name) == made.manifest
    (agent.base / "releases" / made.name / "plan.json").write_text("edited")
    assert agent._manifest(made.name) != made.manifest
    send(agent, made)
    assert agent._manifest(made.name) == made.manifest, "it is sent anew"


def test_the_last_releases_are_kept_and_links_lead_to_them(
    agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(agent, "_must", lambda *_: None)
    names = []
    for number in range(KEPT + 3):
        made = release(str(number))
        send(agent, made)
        agent.trial = {"active": True}
        agent.commit(made.name)
        agent.settle()
        names.append(made.name)
    assert (agent._release("current"), agent._release("previous")) == (names[-1], names[-2])
    releases = {folder.name for folder in (agent.base / "releases").iterdir()}
    assert len(releases) == KEPT
    assert releases <= set(names)
    agent.trial = {"active": False, "before": names[-2]}
    monkeypatch.setattr(agent, "_systemctl", lambda *_: None)
    assert agent.back() == {"release": names[-2], "active": False}
    assert agent.back() is None, "nothing is on trial any more"


def test_a_lock_is_held_until_its_process_ends(agent: Agent) -> None:
    assert agent.take_lock("ann") == {"holder": None}
    second = Agent(SETTINGS | {"system": False}, threading.Event())
    assert second.take_lock("ben")["holder"].startswith("ann, since ")
    assert agent.lock is not None
    os.close(agent.lock)
    assert second.take_lock("ben") == {"holder": None}


def test_a_unit_that_was_restarted_long_ago_has_not_failed(
    agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit_state = {"ActiveState": "active", "NRestarts": "3", "MainPID": "7"}
    monkeypatch.setattr(agent, "_show_unit", lambda: unit_state)
    monkeypatch.setattr(agent, "_journal", lambda: ["last words"])
    assert agent.state()["failed"] is False
    unit_state["NRestarts"] = "4"
    status = agent.wait(10)
    assert (status["failed"], status["lines"]) == (True, ["last words"])


def test_an_unfinished_trial_is_reported_and_a_launchers_release_is_kept(
    agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit_state = {"ActiveState": "active"}
    monkeypatch.setattr(agent, "_show_unit", lambda: unit_state)
    monkeypatch.setattr(agent, "_must", lambda *_: None)
    monkeypatch.setattr(
        agent, "_tfcompose", lambda words, _: subprocess.CompletedProcess(words, 0, "", "")
    )
    names = []
    for number in range(KEPT + 3):
        made = release(str(number))
        send(agent, made)
        names.append(made.name)
        if number == 0:
            plan = agent.base / "releases" / made.name / "plan.json"
            launcher = processes.start(
                [sys.executable, "-c", "input()", str(plan)], stdin=subprocess.PIPE
            )
            unit_state["MainPID"] = str(launcher.pid)
            assert until(lambda: agent._launched_folder() == plan.parent)  # noqa: B023 (at once)
        assert agent.follow(made.name, "brain") == "nothing restarts"
        assert agent.state()["unsettled"]
        agent.commit(made.name)
        agent.settle()
        assert not agent.state()["unsettled"]
    releases = {folder.name for folder in (agent.base / "releases").iterdir()}
    assert {names[0], names[-1], names[-2]} <= releases, "processes use its files"
    assert len(releases) == KEPT


@pytest.mark.parametrize("version", ["(3, 9)", "(3, 12)"])
def test_a_python_that_is_too_old_says_so(version: str) -> None:
    """The version is a stand-in's: tests have one Python."""
    program = f"import sys; sys.version_info = {version}; {START}"
    text = "print('runs')"
    done = processes.run([sys.executable, "-c", program], stdin=f"{len(text)}\n{text}")
    runs = version != "(3, 9)"
    assert (done.stdout, "older than 3.10" in done.stderr) == (
        "runs\n" if runs else "",
        not runs,
    ), done


def test_an_agent_takes_no_module_from_the_folder_it_is_started_in(tmp_path: Path) -> None:
    write_namesakes(tmp_path)
    settings = Settings("rover.brain", "tfcompose-rover.brain.service", sys.executable)
    requests = '["clock", {}]\n["probe", {}]\n'
    done = processes.run(
        ["/bin/sh", "-c", agent_command(sys.executable)],
        stdin=agent_input(settings).decode() + requests,
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path)},
    )
    clock, probe = map(json.loads, done.stdout.splitlines())
    assert clock["answer"]
    assert (probe["answer"]["tfcompose"], done.stderr) == (__version__, "")


@pytest.mark.slow
def test_wheels_are_installed_into_a_python_of_the_release(agent: Agent, tmp_path: Path) -> None:
    wheel = tmp_path / "answer-1-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("answer.py", "VALUE = 42\n")
        archive.writestr(
            "answer-1.dist-info/METADATA", "Metadata-Version: 2.1\nName: answer\nVersion: 1\n"
        )
        archive.writestr(
            "answer-1.dist-info/WHEEL",
            "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        )
        archive.writestr("answer-1.dist-info/RECORD", "")
    made = release("with wheels", **{wheel.name: wheel})
    send(agent, made, wheels=True)
    folder = agent.base / "releases" / made.name
    python = folder / "venv/bin/python"
    assert (
        processes.run([python, "-c", "import answer; print(answer.VALUE)"], check=True).stdout
        == "42\n"
    )
    assert agent._manifest(made.name) == made.manifest
    assert agent._python_of(folder) == str(python)
    wheel.write_bytes(b"no wheel")
    broken = release("broken", **{wheel.name: wheel})
    with pytest.raises(HostError, match="wheels cannot be installed"):
        send(agent, broken, wheels=True)
    assert not (agent.base / "releases" / broken.name).exists()
