"""The computers on which a robot's processes run, and how to reach them."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field, Strict

from tfcompose.foundation.units import format_value, invalid
from tfcompose.spec.language.spec import Entry, key
from tfcompose.spec.language.values import Integral, Matches, OneOrMore, Text

_WITH_PORT = re.compile(r"((?:[^@:]+@)?[^@:]+):([0-9]+)")


def _without_port(value: str) -> str:
    if match := _WITH_PORT.fullmatch(value):
        raise invalid(
            "TF106", f"{format_value(value)} has a port", f"ssh: {match[1]}, port: {match[2]}"
        )
    return value


#: An address for ssh. ssh must not mistake it for an option.
SshAddress = Annotated[
    Text,
    Matches(r"([A-Za-z0-9_][A-Za-z0-9._-]*@)?[A-Za-z0-9:\[][A-Za-z0-9._:%\[\]-]*", "user@address"),
    AfterValidator(_without_port),
]


#: A host's name, which becomes part of the names of folders, systemd units and nodes.
HostName = Annotated[
    Text, Matches(r"[A-Za-z0-9][A-Za-z0-9._-]*", "a host's name: letters, digits, ., _ and -")
]


class HostSpec(Entry):
    """A computer: its address for ssh, and its Python with tfcompose."""

    ssh: SshAddress | None = key(
        None,
        "user@address, or a name in ~/.ssh/config; default: the name of the host",
        "pi@192.168.1.20",
    )
    port: Annotated[int, Strict(), Field(ge=1, le=65535), Integral] | None = key(
        None, "the ssh port; default: as in ~/.ssh/config, or 22", 2222
    )
    python: Text | None = key(
        None,
        "the Python with tfcompose on the host; default: python3",
        "/opt/robot/.venv/bin/python",
    )
    setup: OneOrMore = key((), "files on the host to source first", "/opt/ros/jazzy/setup.bash")
    node_selector: dict[str, Text] = key(
        {},
        "labels of its Kubernetes node; default: kubernetes.io/hostname: NAME",
        {"robot.example.com/computer": "brain"},
    )
