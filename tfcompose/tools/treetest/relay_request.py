"""Request to a relay, and the command whose TF goes to it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import msgspec

from tfcompose.launcher.preflight import LAUNCH
from tfcompose.model.plan.topics import GLOBAL

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from typing_extensions import Self

#: Topics of moving and of fixed edges.
Topics = tuple[str, str]


class RelayRequest(msgspec.Struct, frozen=True):
    """What a relay is given."""

    #: The file with the case's ``LiveSetup``.
    setup: str
    #: The process whose messages it relays.
    process: str
    #: The topics from the process to the relay.
    topics: Topics
    #: The topics of the process by the plan.
    published: Topics

    @classmethod
    def read(cls, text: str) -> Self:
        """Return the request that ``text`` is."""
        return msgspec.json.decode(text, type=cls)

    @property
    def text(self) -> str:
        """The request as JSON."""
        return msgspec.json.encode(self).decode()


def published_topics(argv: Sequence[str], topics: Topics) -> Topics:
    """Return the topics on which a command publishes TF, by the plan or by its remappings.

    A strict guard remaps them after the plan is made.
    """
    rules: dict[str, str] = {}
    for argument in argv:
        old, separator, new = argument.partition(":=")
        if separator and old in GLOBAL:
            rules.setdefault(old, new)  # ROS applies the first
    moving, fixed = topics
    return rules.get(GLOBAL[0], moving), rules.get(GLOBAL[1], fixed)


def redirect(
    argv: Sequence[str], env: Mapping[str, str], request: RelayRequest
) -> tuple[list[str], dict[str, str]]:
    """Return the command and the environment with which a process publishes for its relay."""
    rules = dict(
        [
            *zip(GLOBAL, request.topics, strict=True),
            *zip(request.published, request.topics, strict=True),
        ]
    )
    if LAUNCH in env:
        settings = json.loads(env[LAUNCH])
        rules |= {old: new for old, new in settings["remap"].items() if old not in rules}
        return list(argv), {**env, LAUNCH: json.dumps(settings | {"remap": rules})}
    arguments = [argument for rule in rules.items() for argument in ("-r", ":=".join(rule))]
    begin = argv.index("--ros-args") if "--ros-args" in argv else len(argv)
    return [*argv[:begin], "--ros-args", *arguments, *argv[begin + 1 :]], dict(env)
