"""Node presets and hand-written claims: the edges that a node publishes by itself.

In a preset, ``{map}``, ``{odom}`` and others stand for the frames of the robot with these roles.
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
    """A source of the numbers in a preset."""

    repository: Text = key(..., "the repository", "github.com/IntelRealSense/realsense-ros")
    path: Text = key(..., "the file in it", "realsense2_description/urdf/_d435i.urdf.xacro")
    commit: Text = key(..., "the commit that was read")
    about: Text = key(
        "", "the values from this source, if not all; and whether it is not the vendor's"
    )


class ClaimSpec(Spec):
    """An edge that a node publishes by default, with the parameters that turn it off."""

    parent: Text = key(..., "the parent frame", "odom")
    child: Text = key(..., "the child frame", "base_link")
    off: Off = key(
        ...,
        "the parameters that turn it off, or none",
        {"publish_tf": False},
        NO_SWITCH,
    )
    on: Parameters = key({}, "the parameters that turn it on", {"publish_tf": True})
    by_default: Boolean = key(True, "false: it publishes the edge only if a parameter turns it on")
    static: Boolean = key(False, "true: it sends the edge on /tf_static")
    chosen_by: Parameters = key({}, "the parameters that select this edge", {"two_d_mode": True})


class Role(Spec):
    """A frame whose name is a parameter of the node."""

    parameter: Text | None = key(
        None, "the parameter with its name; left out if it cannot be changed"
    )
    instead: Text | None = key(
        None, "the parameter with the name of the published frame, if it is set"
    )
    default: Text = key(..., "the name without the parameter", "odom")


class NodePresetSpec(Spec):
    """A node that publishes TF: its edges, their frame names, and the way to turn it off."""

    preset: Literal[1] = key(..., "the version of this language", 1)
    node: Text = key(..., "the usual name of the node", "slam_toolbox")
    package: Text = key(..., "its package", "slam_toolbox")
    executable: Text = key(
        "", "the executable that starts it; left out if another program does", "ekf_node"
    )
    about: Text = key(..., "a description in one sentence")
    frames: dict[str, Role] = key({}, "the parameter with the frame name of each role")
    publishes: tuple[ClaimSpec, ...] = key(..., "the edges that it publishes")
    one_of: Boolean = key(False, "true: it publishes one of the edges, never two")
    set: Parameters = key({}, "parameters that are required for its frame names to apply")
    rate: Text = key("", "the parameter with its rate, in Hz", "frequency")
    period: Text = key("", "the parameter with its period, in s", "transform_publish_period")
    hint: Text = key("", "how to turn it off, if no start parameter does")
    source: tuple[Fact, ...] = key(..., "the sources")

    def rate_in(self, params: dict[str, Any]) -> tuple[str, float]:
        """Return the parameter that determines the node's rate, and that rate in Hz.

        Empty and infinite if the parameters do not determine the rate.
        """
        period = params.get(self.period)
        if isinstance(period, (int, float)) and period > 0:
            return self.period, 1 / period
        rate = params.get(self.rate)
        if isinstance(rate, (int, float)):
            return self.rate, rate
        return "", math.inf
