"""What to say where no TF came: with which settings it was looked, and where there is TF instead."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe.seen import listed
from tfcompose.ros.environment import DOMAIN, RANGE, RMW
from tfcompose.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

#: The variables that decide who hears whom.
VARIABLES = (DOMAIN, RANGE, "ROS_LOCALHOST_ONLY", RMW, "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")


def said(settings: Mapping[str, str]) -> str:
    """Return the settings as people read them."""
    words = [f"{name}={settings[name]}" for name in VARIABLES if settings.get(name)]
    if not settings.get(DOMAIN):
        words.insert(0, f"{DOMAIN} unset (0)")
    return ", ".join(words)


def tf_elsewhere(topics: Iterable[tuple[str, Sequence[str]]], own: Iterable[str]) -> tuple[str, ...]:
    """Return the names of topics with TF, of (name, types), that are none of our own, and not hidden (``/_…``)."""
    return tuple(name for name, types in topics if TF_MESSAGE in types and name not in set(own) and "/_" not in name)


def namespace_words(names: Iterable[str]) -> str:
    """Return the options that lead to these topics: ``--namespace /robot1 or --namespace /robot2``."""
    spaces = dict.fromkeys(name.rpartition("/")[0] for name in names)
    return " or ".join(f"--namespace {name}" if name else "without --namespace" for name in spaces)


def advice(elsewhere: Sequence[str]) -> str:
    """Return what to do where no TF came and there is some on other topics, or none."""
    if elsewhere:
        return f"there is TF on {listed(elsewhere)}: {namespace_words(elsewhere)}"
    return "is the robot running, and with these settings? tfcompose doctor looks for the reason"
