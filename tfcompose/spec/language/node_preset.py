"""Node presets and hand-written claims: the edges that a node publishes by itself.

In a preset ``{map}``, ``{odom}`` … stand for the frames of the robot that have these roles.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.values import Boolean, Parameters, Text

NO_SWITCH = "none"

Off = Annotated[
    Parameters,
    BeforeValidator(
        lambda value: {} if value == NO_SWITCH else value, Literal["none"] | dict[str, Any]
    ),
]


class Fact(Spec):
    """Where the figures of a preset are from."""

    repository: Text = key(..., "the repository", "github.com/IntelRealSense/realsense-ros")
    path: Text = key(..., "the file in it", "realsense2_description/urdf/_d435i.urdf.xacro")
    commit: Text = key(..., "the commit that was read")
    about: Text = key("", "what is from there, if not everything; whether it is not the vendor's")


class ClaimSpec(Spec):
    """An edge that a node publishes by default, and the parameters that stop it."""

    parent: Text = key(..., "the parent frame", "odom")
    child: Text = key(..., "the child frame", "base_link")
    off: Off = key(
        ...,
        "the parameters that stop it; none where there are none",
        {"publish_tf": False},
        NO_SWITCH,
    )
    on: Parameters = key({}, "the parameters that start it", {"publish_tf": True})
    by_default: Boolean = key(
        True, "false: it publishes the edge only where a parameter turns that on"
    )
    static: Boolean = key(False, "true: it sends the edge on /tf_static")
    chosen_by: Parameters = key(
        {}, "the parameters that choose this edge among several", {"two_d_mode": True}
    )


class Role(Spec):
    """A frame whose name a node takes from a parameter."""

    parameter: Text | None = key(
        None, "the parameter that holds its name; default: it cannot be changed"
    )
    instead: Text | None = key(
        None, "the parameter that holds the name of the published frame, where it is set"
    )
    default: Text = key(..., "the name without the parameter", "odom")


class NodePresetSpec(Spec):
    """A node that publishes TF: its edges, their name parameters, and its switch."""

    preset: Literal[1] = key(..., "the version of this language", 1)
    node: Text = key(..., "the node's own name", "slam_toolbox")
    package: Text = key(..., "its package", "slam_toolbox")
    executable: Text = key(
        "", "the executable that starts it; none where another program does", "ekf_node"
    )
    about: Text = key(..., "what it is, in a sentence")
    frames: dict[str, Role] = key({}, "the parameter that names the frame of each role")
    publishes: tuple[ClaimSpec, ...] = key(..., "the edges that it publishes")
    one_of: Boolean = key(False, "true: it publishes one of the edges, never two")
    set: Parameters = key(
        {}, "parameters without which its frames would not have the names that it is given"
    )
    rate: Text = key("", "the parameter that says how often it sends, in Hz", "frequency")
    period: Text = key("", "the same, where it is a time in s", "transform_publish_period")
    hint: Text = key(
        "", "where its switch is, if it is not among the parameters that can be given at the start"
    )
    source: tuple[Fact, ...] = key(..., "where this was read")

    def rate_in(self, params: dict[str, Any]) -> tuple[str, float]:
        """Return the parameter that says how often the node sends, and that in Hz.

        Empty, and infinitely often, where these parameters do not say it.
        """
        period = params.get(self.period)
        if isinstance(period, (int, float)) and period > 0:
            return self.period, 1 / period
        rate = params.get(self.rate)
        if isinstance(rate, (int, float)):
            return self.rate, rate
        return "", math.inf
