"""What the commands about a running robot share: which one is meant, and how it is asked."""

from __future__ import annotations

import os
import sys
import time
from typing import TYPE_CHECKING, TypeVar

from tfcompose.cli.reader import wait_for
from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.ipc import REQUESTS, Done, EventsRequest, ProcessRequest, read_notice
from tfcompose.run.launcher.control import RefusedError, ask, connect
from tfcompose.run.place import PlaceError, places

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Callable, Iterator
    from typing import TextIO

    from tfcompose.ipc import Notice, Request, Verb
    from tfcompose.run.place import Holder, Place

A = TypeVar("A")


def add_robot(parser: ArgumentParser) -> None:
    """Add --robot."""
    parser.add_argument(
        "--robot", metavar="NAME", help="which of several running robots: its name, or name@domain; default: the one"
    )


def running() -> list[tuple[Place, Holder]]:
    """Return the robots that run, and who runs each.

    Raises:
        PlaceError: if there is no folder that only this user can open.
    """
    found = [(place, place.holder()) for place in places(os.environ)]
    return [(place, holder) for place, holder in found if holder]


def is_meant(place: Place, name: str | None) -> bool:
    """Return whether this name means the robot: its own, one without the domain, or without a host's name too."""
    share = place.name.rpartition("@")[0]
    return name is None or name in {place.name, share, share.partition(".")[0]}


def chosen(name: str | None, *, among: Callable[[], list[Place]] | None = None) -> Place | int:
    """Return the place of the robot that is meant, or the exit code after saying why there is none."""
    try:
        known = among() if among else [place for place, _ in running()]
    except PlaceError as error:
        complain(str(error))
        return UNREADABLE
    what = "robot has run here" if among else "robot is running"
    found = [place for place in known if is_meant(place, name)]
    names = ", ".join(place.name for place in known)
    if not known:
        complain(f"no {what}")
    elif not found:
        complain(f"no {what} by the name {name}: there is {names}")
    elif len(found) > 1:
        complain(f"several robots are there: {', '.join(place.name for place in found)}; choose one with --robot")
        return UNREADABLE
    else:
        return found[0]
    return 1


def asked(place: Place, request: Request, answer: type[A]) -> A | int:
    """Return the launcher's answer, or the exit code after saying why there is none."""
    try:
        return ask(place, request, answer)
    except RefusedError as error:
        complain(str(error))
    except OSError as error:
        complain(f"{place.name} does not answer: {error}")
    return 1


def ask_of_each(arguments: Namespace, do: Verb, doing: str) -> int:
    """Have the launcher do it with each of the named processes; return the exit code."""
    place = chosen(arguments.robot)
    if isinstance(place, int):
        return place
    codes = []
    for name in arguments.name:
        answer = asked(place, ProcessRequest(do, name), Done)
        if isinstance(answer, Done):
            later = f", and waits for {answer.waits}" if answer.waits else ""
            answer = told(f"{name}: {doing}{later}")
        codes.append(answer)
    return max(codes)


def events(
    place: Place, timeout_s: float | None = None, for_whom: TextIO | None = None
) -> Iterator[tuple[Notice, float]]:
    """Yield what the launcher has told and tells, with when, until it ends.

    ``for_whom`` is where this is written: when nobody reads there any more, it is over, also while nothing is told.

    Raises:
        OSError: if it cannot be heard; TimeoutError if the time is over; BrokenPipeError if nobody reads.
    """
    end = None if timeout_s is None else time.monotonic() + timeout_s
    with connect(place) as connection:
        connection.sendall(REQUESTS.line(EventsRequest()).encode())
        rest = b""
        while True:
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0:
                raise TimeoutError
            connection.settimeout(left)
            if for_whom and not wait_for(connection, for_whom):
                raise BrokenPipeError
            data = connection.recv(64 * 1024)
            if not data:
                return
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                yield read_notice(line)


def since(holder: Holder) -> str:
    """Return since when, in local time: 14:03:27, with the date if that is not today."""
    at, today = time.localtime(holder.since), time.localtime()
    form = "%H:%M:%S" if at[:3] == today[:3] else "%Y-%m-%d %H:%M:%S"
    return time.strftime(form, at)


def told(answer: str) -> int:
    """Print one line, and return 0."""
    sys.stdout.write(f"{answer}\n")
    return 0
