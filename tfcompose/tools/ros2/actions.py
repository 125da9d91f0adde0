"""Launch actions that start a robot: ``TfCompose`` in Python, ``<tfcompose/>`` in XML and YAML.

An action starts ``tfcompose up``, which supervises the robot. launch supervises this process. A
named pipe passes the events of the robot to launch. If launch is killed, the pipe has no reader,
and ``up`` stops the robot.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from logging import ERROR
from pathlib import Path
from typing import TYPE_CHECKING, Any, List  # noqa: UP035 (see _CHILDREN)

import launch.logging
from launch.actions import EmitEvent, ExecuteProcess, OpaqueFunction
from launch.event_handler import EventHandler
from launch.event_handlers import OnProcessExit
from launch.frontend import Entity, expose_action
from launch.substitutions import LocalSubstitution, TextSubstitution
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

from tfcompose.launcher.program import HERE
from tfcompose.tools.ros2.events import (
    RobotEnded,
    RobotEvent,
    RobotFailed,
    RobotProcessChanged,
    RobotTreeComplete,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from logging import LogRecord

    from launch import LaunchContext
    from launch.events.process import ProcessExited
    from launch.frontend import Parser

    from tfcompose.model.messages import Notice

#: The type with which launch returns the children of an element. launch compares types with
#: ``List``, so ``list`` does not work.
_CHILDREN = List[Entity]  # noqa: UP006
#: Attributes of launch's ``<executable>`` that ``<tfcompose/>`` does not have.
_NOT_FOR_ROBOTS = (
    "cmd",
    "emulate_tty",
    "launch-prefix",
    "name",
    "prefix",
    "respawn",
    "respawn_delay",
    "respawn_max_retries",
    "shell",
)


class RobotFailedError(Exception):
    """Raised in launch if a robot fails, so that launch exits with code 1."""


@expose_action("tfcompose")
class TfCompose(ExecuteProcess):  # type: ignore[misc]  # launch has no types
    """Start the robot of a robot file with ``tfcompose up``.

    ``file`` is the robot file. ``profiles`` and ``overlays`` are merged over it. ``args`` are the
    values of its arguments. Each may contain substitutions. An entry of ``profiles`` may be empty,
    or may contain several names separated by commas. ``trust`` runs xacro and launch files without
    the sandbox.

    Namespace, remappings and ``use_sim_time`` around the action apply to the robot's nodes and
    topics, but never to frames. If the robot fails, launch exits with code 1.
    """

    #: The command of tfcompose that the action runs.
    command = "up"

    def __init__(  # noqa: PLR0913 (keywords)
        self,
        *,
        file: Any,
        profiles: Iterable[Any] = (),
        args: Mapping[str, Any] | None = None,
        overlays: Iterable[Any] = (),
        trust: bool = False,
        output: Any = "screen",
        **options: Any,
    ) -> None:
        name = LocalSubstitution("tfcompose_robot", description="the robot file's name")
        super().__init__(cmd=[*HERE, self.command], name=name, prefix="", output=output, **options)
        self._file = normalize_to_list_of_substitutions(file)
        self._profiles = [normalize_to_list_of_substitutions(profile) for profile in profiles]
        self._overlays = [normalize_to_list_of_substitutions(overlay) for overlay in overlays]
        self._args = {
            name: normalize_to_list_of_substitutions(value) for name, value in (args or {}).items()
        }
        self._trust = trust
        self._events: _EventPipe | None = None

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[TfCompose], dict[str, Any]]:
        """Return the action for an element, and its keywords.

        The attributes of the element are ``file``, ``profile``, ``overlay``, ``trust``, and most
        attributes of launch's ``<executable>``. Its children are ``<arg name="…" value="…"/>``.
        """
        _, options = super().parse(entity, parser, ignore=_NOT_FOR_ROBOTS)
        options["file"] = parser.parse_substitution(entity.get_attr("file"))
        for attribute, keyword in (("profile", "profiles"), ("overlay", "overlays")):
            text = entity.get_attr(attribute, optional=True)
            if text is not None:
                options[keyword] = [parser.parse_substitution(text)]
        trust = entity.get_attr("trust", data_type=bool, optional=True)
        if trust is not None:
            options["trust"] = trust
        declared = entity.get_attr("arg", data_type=_CHILDREN, optional=True) or []
        options["args"] = {
            arg.get_attr("name"): parser.parse_substitution(arg.get_attr("value"))
            for arg in declared
        }
        for arg in declared:
            arg.assert_entity_completely_parsed()
        return cls, options

    def execute(self, context: LaunchContext) -> Any:
        """Start the robot."""
        file = perform_substitutions(context, self._file)
        robot = Path(file).name.partition(".")[0] or "robot"
        self._events = _EventPipe(robot)
        arguments = [file, *self._arguments(context), *_ros_arguments(context)]
        self.cmd.extend([TextSubstitution(text=argument)] for argument in arguments)
        context.extend_locals({"tfcompose_robot": robot})
        context.register_event_handler(
            EventHandler(
                matcher=self._is_failure,
                entities=OpaqueFunction(function=self._fail),
                handle_once=True,
            )
        )
        context.register_event_handler(
            OnProcessExit(target_action=self, on_exit=self._end, handle_once=True)
        )
        started = super().execute(context)
        logger = launch.logging.get_logger(self.process_details["name"])
        logger.addFilter(lambda record: context.is_shutdown or not _is_death(record))
        if context.is_shutdown:
            self._events.close()
        else:
            context.asyncio_loop.add_reader(self._events.fd, self._forward_events, context)
        return started

    def _arguments(self, context: LaunchContext) -> Iterator[str]:
        """Yield the options of ``up``, and the values of the robot's arguments."""
        if self._events:
            yield from ("--no-live", "--events", str(self._events.path))
            yield from ("--output", str(self._events.path.with_name("build")))
        yield from ["--trust"] if self._trust else []
        for option, texts in (("--profile", self._profiles), ("--overlay", self._overlays)):
            for text in texts:
                names = perform_substitutions(context, text).split(",")
                for name in filter(None, map(str.strip, names)):
                    yield from (option, name)
        for name, value in self._args.items():
            yield f"{name}:={perform_substitutions(context, value)}"

    def _forward_events(self, context: LaunchContext) -> None:
        """Pass the received events of the robot to launch."""
        if self._events is None:
            return
        for notice in self._events.read():
            event = self._event(notice)
            if event:
                context.emit_event_sync(event)
        if self._events.is_over:
            context.asyncio_loop.remove_reader(self._events.fd)

    def _event(self, notice: Notice) -> RobotEvent | None:
        """Return the launch event for a notice of the launcher, or None if there is none."""
        from tfcompose.model import messages

        match notice:
            case messages.TreeComplete(edges, seconds):
                return RobotTreeComplete(self, edges, seconds)
            case messages.ProcessState(process, state, pid, detail):
                return RobotProcessChanged(self, process, state, pid, detail)
            case _:
                return None

    def _end(self, event: ProcessExited, context: LaunchContext) -> list[EmitEvent]:
        """Report the end of the robot; if the robot failed, end launch."""
        because: tuple[str, ...] = ()
        if self._events:
            self._forward_events(context)
            because = self._events.because
            context.asyncio_loop.remove_reader(self._events.fd)
            self._events.close()
        ended = EmitEvent(event=RobotEnded(self, event.returncode, because))
        if event.returncode == 0 or context.is_shutdown:
            return [ended]
        return [ended, EmitEvent(event=RobotFailed(self))]

    def _is_failure(self, event: Any) -> bool:
        return isinstance(event, RobotFailed) and event.action is self

    def _fail(self, context: LaunchContext) -> None:
        """End launch with an exception, because launch returns 1 only after an exception."""
        del context
        name, code = self.process_details["name"], self.return_code
        raise RobotFailedError(f"the robot of {name} ended with exit code {code}")


@expose_action("tfcompose_guard")
class TfComposeGuard(TfCompose):
    """Guard the tree of a robot whose nodes this launch file starts itself.

    The action starts only the guard, with ``tfcompose guard``. It has the keywords and attributes
    of ``TfCompose``.
    """

    command = "guard"


class _EventPipe:
    """A named pipe with the robot's events, in a separate folder in launch's log folder."""

    def __init__(self, robot: str) -> None:
        folder = tempfile.mkdtemp(prefix=f"{robot}_", dir=launch.logging.launch_config.log_dir)
        self.path = Path(folder) / "events"
        os.mkfifo(self.path, 0o600)
        self.fd = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        self.because: tuple[str, ...] = ()
        self.is_over = False
        self._rest = b""

    def read(self) -> Iterator[Notice]:
        """Yield the received notices."""
        from tfcompose.model.messages import Ended, read_notice

        while not self.is_over:
            try:
                data = os.read(self.fd, 1 << 16)
            except BlockingIOError:
                return
            self.is_over = not data
            self._remove()
            *lines, self._rest = (self._rest + data).split(b"\n")
            for line in lines:
                notice, _ = read_notice(line)
                if isinstance(notice, Ended):
                    self.because = notice.because
                yield notice

    def close(self) -> None:
        """Close the pipe and remove its file."""
        self.is_over = True
        self._remove()
        os.close(self.fd)

    def _remove(self) -> None:
        """Remove the file, which is no longer needed once both ends are open."""
        with contextlib.suppress(OSError):
            self.path.unlink(missing_ok=True)


def _is_death(record: LogRecord) -> bool:
    """Return whether launch reports a failed process, as ``RobotFailedError`` does."""
    return record.levelno == ERROR and record.getMessage().startswith("process has died")


def _ros_arguments(context: LaunchContext) -> list[str]:
    """Return the namespace, remappings and clock that launch_ros sets around the action."""
    settings = context.launch_configurations
    arguments = []
    namespace = settings.get("ros_namespace", "").strip("/")
    if namespace:
        arguments += ["-r", f"__ns:=/{namespace}"]
    for old, new in settings.get("ros_remaps", None) or []:
        arguments += ["-r", f"{old}:={new}"]
    ignored = []
    for parameter in settings.get("global_params", None) or []:
        if isinstance(parameter, tuple) and parameter[0] == "use_sim_time":
            arguments += ["-p", f"use_sim_time:={str(parameter[1]).lower()}"]
        else:
            ignored.append(parameter[0] if isinstance(parameter, tuple) else str(parameter))
    if ignored:
        launch.logging.get_logger("tfcompose").warning(
            f"parameters of the launch file do not reach the robot's nodes: {', '.join(ignored)};"
            " write them into the robot file"
        )
    return ["--ros-args", *arguments] if arguments else []
