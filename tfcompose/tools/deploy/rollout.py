"""Steps of a deployment, which changes all hosts or none.

A deployment asks every host for its state, locks every host, and sends the release. Each host
checks if it can start the release. Then the deployment stops all hosts, starts the release on
trial, and waits until every edge of every host is live. A launcher that can switch to the release
keeps running. Finally all hosts keep the release, or all hosts return to their previous release.
"""

from __future__ import annotations

import asyncio
import base64
import difflib
import getpass
import os
import time
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, Note, RejectedError, did_you_mean, finding
from tfcompose.foundation.text import duration, list_names, plural
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.hosts import hosts_of, share_of, without_computer
from tfcompose.tools.deploy.agent import UNIT
from tfcompose.tools.deploy.connection import (
    ConnectedHost,
    LostError,
    RefusedError,
    connect_host,
    settings_of,
)
from tfcompose.tools.deploy.following import can_follow, same_files
from tfcompose.tools.deploy.release import name_of
from tfcompose.tools.deploy.unit import Unit

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Plan, PlanHost
    from tfcompose.tools.deploy.release import Release

#: The size in bytes of the chunks in which a release is sent.
CHUNK = 1_000_000
#: The path of the plan in a release.
PLAN = "plan.json"
#: The interval at which a host reports its progress, in seconds.
SLICE_S = 3.0
#: The maximum number of names in a message.
NAMED_AT_MOST = 8


@dataclass(frozen=True, slots=True)
class DeployTarget:
    """The hosts and options of a deployment."""

    plan: Plan
    #: The hosts by name.
    hosts: Mapping[str, PlanHost]
    #: The locations of the hosts in the robot file.
    places: Mapping[str, Span]
    #: Whether units belong to the system's systemd instead of the user's.
    system: bool = False
    #: Whether these are all the hosts that run processes.
    is_complete: bool = True
    #: The largest accepted difference between clocks, in seconds.
    clock_limit_s: float = 0.1
    timeout_s: float = 60.0
    #: Whether to wait until every edge is live.
    waits: bool = True


@dataclass(slots=True)
class Share:
    """The state of a host during a deployment, with its current and its new release."""

    host: ConnectedHost
    unit: Unit
    #: The agent's answer to ``probe``.
    probe: dict[str, Any]
    #: The agent's answer to ``state``.
    state: dict[str, Any] = field(default_factory=dict)
    release: Release | None = None
    #: The name of the release to run.
    goal: str = ""
    #: Whether its launcher can switch to the release while it runs.
    follows: bool = False

    @property
    def name(self) -> str:
        """The host's name."""
        return self.host.name

    @property
    def new_release(self) -> Release:
        """The release with which the host's current release is compared."""
        assert self.release is not None, "it is made before anything is compared"  # noqa: S101
        return self.release

    def describe(self) -> str:
        """Return a description of the host."""
        probe = self.probe
        version = f"tfcompose {probe['tfcompose']}" if probe["tfcompose"] else "no tfcompose"
        logout = "" if probe["lingers"] else ", stops at logout unless: loginctl enable-linger"
        return f"Python {probe['python']}, {version}{logout}"

    def changes(self) -> list[str]:
        """Return a line for each change on the host.

        The list is empty if the host already runs the release.
        """
        if self.release is None:
            return [f"release {self.state['release']} → {self.goal}"]
        installed, manifest = self.state["files"], self.new_release.manifest
        changed = [
            ("new", manifest.keys() - installed.keys()),
            ("removed", installed.keys() - manifest.keys()),
        ]
        changed.append(
            (
                "changed",
                {
                    path
                    for path in manifest.keys() & installed.keys()
                    if manifest[path] != installed[path]
                },
            )
        )
        lines = [f"{path}: {change}" for change, paths in changed for path in sorted(paths)]
        if self.state["unit"] != self.unit.text():
            lines.append(f"{self.unit.file}: {'changed' if self.state['unit'] else 'new'}")
        if not lines and (self.state["unsettled"] or not self.state["active"]):
            lines.append(f"{self.unit.file}: started")
        if not lines and not self.state["enabled"]:
            lines.append(f"{self.unit.file}: enabled")
        return lines


class Rollout:
    """A deployment to connected hosts. ``report`` is called with progress messages."""

    def __init__(
        self, target: DeployTarget, shares: list[Share], report: Callable[[str], None]
    ) -> None:
        self.target = target
        self.shares = shares
        self.report = report

    # Steps that change nothing

    async def examine(self) -> list[Finding]:
        """Return findings about the hosts, and about differences between them."""
        offsets = await self._by_name(lambda share: share.host.clock_offset_s())
        findings = [finding for share in self.shares for finding in self._unfit(share)]
        findings += _clocks_apart(offsets, self.target)
        findings += _settings_apart(self.shares, self.target)
        for share in self.shares:
            self.report(
                f"{share.name}: {share.describe()}, clock {offsets[share.name] * 1000:+.1f} ms"
            )
        return findings

    def _unfit(self, share: Share) -> Iterable[Finding]:
        probe, span, name = share.probe, share.host.span, share.name
        for problem in probe["problems"]:
            yield finding("TF914", f"{name} cannot run the robot: {problem}", span)
        if probe["tfcompose"] is None and not probe["problems"] and not share.unit.has_wheels:
            advice = (
                f"install it there, name its Python, hosts: {{{name}: {{python: FILE}}}}, or give"
                " --wheels FOLDER"
            )
            yield finding(
                "TF914", f"{name} has no tfcompose for {probe['executable']}", span, help=advice
            )

    async def compare(self, release: Release) -> None:
        """Read the state of each host, and compute its goal with this release."""
        states = await self._by_name(lambda share: share.host.ask("state"))
        for share in self.shares:
            share.state = states[share.name]
            share.release = release.with_text(UNIT, share.unit.text())
            share.goal = share.release.name
        await self._decide_who_follows(release.plan)

    async def _decide_who_follows(self, plan: Plan) -> None:
        """Set ``follows`` for hosts whose launchers can keep running.

        This is possible only if the plans of all changing hosts allow it.
        """
        changing = [share for share in self.shares if share.changes() and share.state["release"]]
        texts = await asyncio.gather(
            *(share.host.ask("texts", paths=[PLAN], any_size=True) for share in changing)
        )
        try:
            before = [read_plan(some[PLAN], PLAN) for some in texts if some.get(PLAN)]
        except RejectedError:  # a plan of another version
            return
        if len(before) < len(changing) or not all(can_follow(share, plan) for share in before):
            return
        for share in changing:
            share.follows = self._is_sound(share) and same_files(
                share.state["files"], share.new_release.manifest
            )

    def _is_sound(self, share: Share) -> bool:
        """Return whether a host runs its deployed release, with all its processes."""
        state, robot = share.state, share.state["robot"]
        if (
            robot is None
            or state["failed"]
            or state["unsettled"]
            or not state["active"]
            or state["unit"] != share.unit.text()
        ):
            return False
        late = any(
            process["failed"] or not process["ready"]
            for process in robot["processes"]
            if process["kind"] != "external"
        )
        return not late and name_of(state["files"]) == state["release"]

    def strangers(self) -> list[Finding]:
        """Return findings about robots that run on hosts without a deployment."""
        return [
            finding(
                "TF914",
                f"{self.target.plan.robot} is already running on {share.name}, but not as"
                f" {share.unit.file}: pid {share.state['stranger']}",
                share.host.span,
                help=f"stop it there: tfcompose down --robot {share.unit.name}",
            )
            for share in self.shares
            if share.state["stranger"]
        ]

    def changes(self) -> dict[str, list[str]]:
        """Return a line for each change, by host.

        A host that already runs its goal has no entry.
        """
        changes = {share.name: share.changes() for share in self.shares}
        return {name: lines for name, lines in changes.items() if lines}

    def describe(self) -> str:
        """Return a text with the release of each host."""
        return list_names(
            [f"{share.name} runs release {share.state['release']}" for share in self.shares],
            NAMED_AT_MOST,
        )

    async def difference(self) -> list[str]:
        """Return the lines of a unified diff of all texts that would change."""
        lines: list[str] = []
        for share in self.shares:
            installed, manifest = share.state["files"], share.new_release.manifest
            paths = sorted(
                path
                for path in installed.keys() | manifest.keys()
                if installed.get(path) != manifest.get(path)
            )
            texts = await share.host.ask(
                "texts", paths=[path for path in paths if path in installed]
            )
            for path in paths:
                before, after = texts.get(path), share.new_release.texts.get(path)
                if before is None and after is None:
                    lines.append(f"{share.name}/{path}: differs (not text)")
                    continue
                names = (f"{share.name}/{path} (there)", f"{share.name}/{path} (here)")
                lines += difflib.unified_diff(
                    (before or "").splitlines(), (after or "").splitlines(), *names, lineterm=""
                )
        return lines

    # Steps of the change

    async def lock(self) -> None:
        """Take the locks of all hosts, in the same order in every deployment.

        Raises:
            RejectedError: with the holder of a lock that is taken.
        """
        who = f"{getpass.getuser()}@{os.uname().nodename}, pid {os.getpid()}"
        for share in sorted(self.shares, key=lambda share: share.name):
            answer = await self._ask(share, "take_lock", who=who)
            if answer["holder"]:
                message = f"{answer['holder']} is deploying to {share.name}"
                raise RejectedError(
                    [finding("TF915", message, share.host.span, help="wait until it has finished")]
                )

    async def send(self) -> None:
        """Send the release to hosts that do not have it, and check that they can start it.

        Raises:
            RejectedError: with findings that prevent a start. The hosts still run what they ran
            before.
        """
        await self._all(self._send)
        findings = [finding for some in await self._all(self._rehearse) for finding in some]
        if findings:
            await self._all(
                lambda share: self._ask(share, "discard", release=share.new_release.name)
            )
            raise RejectedError(findings)

    async def _send(self, share: Share) -> None:
        release = share.new_release
        if share.state["release"] == release.name and share.state["files"] == release.manifest:
            return
        size = 0
        rest = b""
        for part in release.archive():
            rest += part
            while len(rest) >= CHUNK:
                await self._ask(share, "chunk", data=base64.b64encode(rest[:CHUNK]).decode())
                size, rest = size + CHUNK, rest[CHUNK:]
        await self._ask(share, "chunk", data=base64.b64encode(rest).decode())
        await self._ask(
            share, "unpack", timeout_s=1200.0, release=release.name, wheels=release.has_wheels
        )
        files = plural(len(release.manifest), "file")
        self.report(
            f"{share.name}: release {release.name}, {files}, {(size + len(rest)) / 1e6:.1f} MB"
        )

    async def _rehearse(self, share: Share) -> list[Finding]:
        answers = await self._ask(
            share, "rehearse", release=share.new_release.name, host=share.name
        )
        span = share.host.span
        return [
            finding(
                finding_there["code"],
                f"{share.name}: {finding_there['message']}",
                span,
                help=finding_there["help"],
            )
            for finding_there in answers
        ]

    async def activate(self) -> str:
        """Start each host's goal on trial, and keep it once every edge is live.

        Return a summary. A host that already runs its goal keeps running. A host whose launcher
        can switch restarts only the processes that differ.

        Raises:
            RejectedError: with missing edges or a lost host, and the releases to which the other
            hosts returned.
        """
        begun = time.monotonic()
        changing = [share for share in self.shares if share.changes()]
        anew = [share for share in changing if not share.follows]
        try:
            await self._all(lambda share: self._ask(share, "stop"), anew)
            await self._all(lambda share: self._ask(share, "start", release=share.goal), anew)
            await self._all(self._follow, [share for share in changing if share.follows])
            live = await self._until_live(begun) if self.target.waits else "started"
            await self._all(lambda share: self._ask(share, "commit", release=share.goal), changing)
        except RejectedError as error:
            first, *further = error.findings
            notes = (*first.notes, *await self._back(changing))
            raise RejectedError([replace(first, notes=notes), *further]) from None
        except BaseException:
            await self._back(changing)
            raise
        await self._all(self._settle, changing)
        return f"{live} after {duration(time.monotonic() - begun)}"

    async def _follow(self, share: Share) -> None:
        answer = await self._ask(share, "follow", release=share.goal, host=share.name)
        self.report(f"{share.name}: {answer}")

    async def _settle(self, share: Share) -> None:
        try:
            await self._ask(share, "settle")
        except RejectedError as error:
            notes = (Note("every edge was live, and the other hosts keep the release"),)
            advice = "deploy again once it is back: it may have returned to the previous release"
            raise RejectedError([replace(error.findings[0], notes=notes, help=advice)]) from None

    async def _until_live(self, begun: float) -> str:
        end = begun + self.target.timeout_s
        while True:
            left = end - time.monotonic()
            seconds = max(min(SLICE_S, left), 0.1)
            states = await self._all(self._waiting(seconds))
            missing = [
                problem for some in map(self._missing, self.shares, states) for problem in some
            ]
            if not missing:
                hosts = list_names([share.name for share in self.shares], NAMED_AT_MOST)
                return f"{plural(len(self._edges()), 'edge')} live on {hosts}"
            if left <= seconds or any(state["failed"] for state in states):
                raise RejectedError(missing)

    def _waiting(self, seconds: float) -> Callable[[Share], Awaitable[Any]]:
        return lambda share: self._ask(share, "wait", seconds=seconds)

    async def not_live(self, *, waits: bool) -> list[Finding]:
        """Return findings about edges and processes that ``compare`` did not find live.

        With ``waits``, hosts that have just booted get the deployment's time for their edges.
        """
        findings = [
            problem for share in self.shares for problem in self._missing(share, share.state)
        ]
        if waits and findings and all(share.state["robot"] for share in self.shares):
            try:
                await self._until_live(time.monotonic())
            except RejectedError as error:
                return list(error.findings)
            return []
        return findings

    async def plan_return(self) -> None:
        """Make the previous release each host's goal.

        Raises:
            RejectedError: if a host has no previous release.
        """
        states = await self._by_name(lambda share: share.host.ask("state"))
        findings = []
        for share in self.shares:
            share.state, share.goal = states[share.name], states[share.name]["previous"] or ""
            if not share.goal:
                findings.append(
                    finding("TF912", f"{share.name} has no previous release", share.host.span)
                )
        if findings:
            raise RejectedError(findings)

    def _edges(self) -> list[str]:
        plan, names = self.target.plan, {share.name for share in self.shares}
        names_of_processes = {process.name for process in plan.processes if process.host in names}
        return [
            edge.name
            for edge in plan.edges
            if self.target.is_complete or edge.owner in names_of_processes
        ]

    def _missing(self, share: Share, state: dict[str, Any]) -> list[Finding]:
        """Return findings about missing processes and edges, from a host's launcher.

        If the deployment is only for some hosts, return only findings about these hosts.
        """
        plan, robot, span = self.target.plan, state["robot"], share.host.span
        notes = [Note(line) for line in state["lines"]]
        if robot is None or state["failed"]:
            what = "keeps exiting" if state["failed"] else "does not run"
            return [finding("TF917", f"{plan.robot} {what} on {share.name}", span, notes=notes)]
        expected = set(self._edges())
        missing = [
            edge
            for edge in dict.fromkeys((*robot["missing"], *robot["silent"]))
            if edge in expected
        ]
        late = [
            process
            for process in robot["processes"]
            if process["kind"] != "external" and (process["failed"] or not process["ready"])
        ]
        findings = []
        if missing:
            hosts = {edge.name: plan.process(edge.owner).host or edge.owner for edge in plan.edges}
            named = list(missing)
            for index, edge in enumerate(missing):
                if hosts[edge] != share.name:
                    named[index] = f"{edge} (of {hosts[edge]})"
            message = f"{len(missing)} of {len(expected)} edges are not live on {share.name}: "
            findings.append(finding("TF917", message + list_names(named, NAMED_AT_MOST), span))
        if late:
            named = [
                f"{process['name']} ({process['detail'] or process['waits'] or process['state']})"
                for process in late
            ]
            findings.append(
                finding(
                    "TF917", f"not ready on {share.name}: {list_names(named, NAMED_AT_MOST)}", span
                )
            )
        return findings

    async def _back(self, shares: Sequence[Share]) -> list[Note]:
        """Return these hosts to their previous releases, and return a note for each host.

        If a host fails, the others still return.
        """
        answers = await asyncio.gather(
            *(share.host.ask("back") for share in shares), return_exceptions=True
        )
        notes = []
        for share, answer in zip(shares, answers, strict=True):
            if isinstance(answer, BaseException):
                notes.append(
                    Note(
                        f"{share.name} {answer}; it returns to the previous release as soon as it"
                        " can, at the latest at its next boot"
                    )
                )
            elif answer is None:
                continue
            elif answer["release"]:
                runs = "" if answer["active"] else ", stopped as before"
                notes.append(Note(f"{share.name} returned to release {answer['release']}{runs}"))
            else:
                notes.append(Note(f"{share.name} had no previous release and runs nothing"))
        return notes

    # Requests to hosts

    async def _ask(self, share: Share, request: str, **arguments: Any) -> Any:
        """Send a request to a host and return the answer.

        Raises:
            RejectedError: if the host is lost, or cannot carry out the request.
        """
        try:
            return await share.host.ask(request, **arguments)
        except LostError as error:
            raise RejectedError(
                [finding("TF917", f"{share.name} {error}", share.host.span)]
            ) from None
        except RefusedError as error:
            raise RejectedError(
                [finding("TF917", f"{share.name}: {error}", share.host.span)]
            ) from None

    async def _all(
        self, do: Callable[[Share], Awaitable[Any]], shares: Sequence[Share] | None = None
    ) -> list[Any]:
        """Call a function for all hosts, or for these, concurrently; return the results.

        Raises:
            RejectedError: with the findings of all hosts, after all calls have ended.
        """
        answers = await asyncio.gather(
            *(map(do, self.shares if shares is None else shares)), return_exceptions=True
        )
        findings: list[Finding] = []
        for answer in answers:
            if isinstance(answer, RejectedError):
                findings += answer.findings
            elif isinstance(answer, BaseException):
                raise answer
        if findings:
            raise RejectedError(findings)
        return answers

    async def _by_name(self, do: Callable[[Share], Awaitable[Any]]) -> dict[str, Any]:
        async def safe(share: Share) -> Any:
            try:
                return await do(share)
            except (LostError, RefusedError) as error:
                raise RejectedError(
                    [finding("TF913", f"{share.name} {error}", share.host.span)]
                ) from None

        answers = await self._all(safe)
        return {share.name: answer for share, answer in zip(self.shares, answers, strict=True)}


async def _probe(host: ConnectedHost) -> dict[str, Any]:
    try:
        probe: dict[str, Any] = await host.ask("probe")
    except (LostError, RefusedError) as error:
        raise RejectedError([finding("TF913", f"{host.name} {error}", host.span)]) from None
    return probe


def target_of(
    plan: Plan, names: Sequence[str], places: Mapping[str, Span], **options: Any
) -> DeployTarget:
    """Return the target of a deployment: all hosts with processes, or the named hosts.

    ``options`` are further fields of ``DeployTarget``.

    Raises:
        RejectedError: with findings about missing parts of the robot file.
    """
    used = [name for name in plan.hosts if name in hosts_of(plan)]
    if not plan.hosts:
        advice = "hosts: {NAME: {ssh: user@address}}, and processes: {static: {host: NAME}}"
        raise RejectedError(
            [finding("TF912", f"{plan.robot} has no hosts to deploy to", None, help=advice)]
        )
    if nowhere := without_computer(plan):
        message = f"{list_names(nowhere, NAMED_AT_MOST)} would have no host"
        advice = (
            "processes without a host run where static does: processes: {static: {host:"
            f" {next(iter(plan.hosts))}}}}}"
        )
        raise RejectedError([finding("TF912", message, None, help=advice)])
    findings = []
    for name in names:
        if name not in used:
            listed = f"hosts with processes: {', '.join(used)}"
            message = f"no process of {plan.robot} runs on a host named {name}"
            findings.append(finding("TF819", message, None, help=did_you_mean(name, used, listed)))
    shares = [share_of(plan, name, "") for name in used]
    findings += [share for share in shares if isinstance(share, Finding)]
    if findings:
        raise RejectedError(findings)
    chosen = {name: plan.hosts[name] for name in used if not names or name in names}
    return DeployTarget(plan, chosen, places, is_complete=len(chosen) == len(used), **options)


def _clocks_apart(offsets: Mapping[str, float], target: DeployTarget) -> Iterable[Finding]:
    """Yield a finding if clocks of hosts differ by more than the limit."""
    if len(offsets) < 2:  # noqa: PLR2004 (a difference needs two)
        return
    first, last = (
        min(offsets, key=lambda name: offsets[name]),
        max(offsets, key=lambda name: offsets[name]),
    )
    apart_s = offsets[last] - offsets[first]
    if apart_s > target.clock_limit_s:
        message = f"the clock of {last} is {duration(apart_s)} ahead of that of {first}"
        advice = (
            "bring the clocks together (chrony, or timedatectl set-ntp true), or --clock-limit S"
            " allows more"
        )
        yield finding("TF834", message, target.places.get(last), help=advice)


#: Environment variables that must be equal on all hosts, and the values that apply if they are not
#: set.
_AGREED = {"ROS_DOMAIN_ID": "0", "RMW_IMPLEMENTATION": "the default", "ROS_LOCALHOST_ONLY": "0"}
#: Advice with the key of the robot file that sets a variable on all hosts.
_HOLDS = {
    "ROS_DOMAIN_ID": "set it for all hosts: ros: {domain_id: N}",
    "RMW_IMPLEMENTATION": "set it for all hosts: ros: {rmw: fastdds}, or another",
}


def _settings_apart(shares: Sequence[Share], target: DeployTarget) -> Iterable[Finding]:
    """Yield a finding if nodes on the hosts cannot discover each other.

    Possible reasons are different domains or middlewares, or limited discovery.
    """
    ros = target.plan.ros
    settings = {"ROS_DOMAIN_ID": ros.domain_id, "RMW_IMPLEMENTATION": ros.rmw}
    for variable, default in _AGREED.items():
        if settings.get(variable) is not None:
            continue
        values = {share.name: share.probe["env"].get(variable, default) for share in shares}
        if len(set(values.values())) > 1:
            changed = ", ".join(f"{value} on {name}" for name, value in values.items())
            yield finding(
                "TF916",
                f"{variable} is {changed}",
                None,
                help=_HOLDS.get(variable, "set it alike in setup"),
            )
    if ros.rmw == "zenoh" or len({share.probe["machine"] for share in shares}) == 1:
        return  # a router connects the hosts, or all hosts are the same computer
    range_of = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    reaches = {
        share.name: (ros.discovery or share.probe["env"].get(range_of, "subnet")).lower()
        for share in shares
    }
    for reach in ("localhost", "off"):
        if kept := [name for name, share in reaches.items() if share == reach]:
            message = (
                f"discovery: {reach} keeps nodes from those of other hosts on"
                f" {list_names(kept, NAMED_AT_MOST)}"
            )
            yield finding("TF916", message, None, help="ros: {discovery: subnet}")


@asynccontextmanager
async def reach_hosts(
    target: DeployTarget,
    has_wheels: bool,  # noqa: FBT001
    report: Callable[[str], None],
) -> AsyncIterator[Rollout]:
    """Connect to all hosts of the target at once.

    Raises:
        RejectedError: with a finding for each host that cannot be reached or cannot run the agent.
    """
    plan = target.plan
    connecting = []
    for name, host in target.hosts.items():
        settings = settings_of(plan.robot, name, host, system=target.system)
        connecting.append(connect_host(name, host, settings, target.places.get(name)))
    done = await asyncio.gather(*connecting)
    hosts = [result for result in done if isinstance(result, ConnectedHost)]
    try:
        if findings := [result for result in done if isinstance(result, Finding)]:
            raise RejectedError(findings)
        rollout = Rollout(target, [], report)
        for connected_host, probe in zip(
            hosts, await asyncio.gather(*(_probe(host) for host in hosts)), strict=True
        ):
            unit = Unit(
                f"{plan.robot}.{connected_host.name}",
                plan.robot,
                connected_host.name,
                base=probe["base"],
                python=probe["executable"],
                setup=tuple(probe["setup"]),
                system=target.system,
                has_wheels=has_wheels,
            )
            rollout.shares.append(Share(connected_host, unit, probe))
        yield rollout
    finally:
        await asyncio.gather(*(host.close() for host in hosts), return_exceptions=True)
