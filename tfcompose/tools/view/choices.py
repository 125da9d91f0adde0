"""Choices that the user makes in a view, such as the selected frame.

The view builds a new panel when a file changes. The choices stay, because they refer to frames,
owners and sensors by name.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Choices:
    """Choices in a view. They may name frames, owners or sensors that no longer exist."""

    #: The selected frame; empty for none.
    selected: str = ""
    #: The frame in which the panel shows poses; empty for the parent of each frame.
    base: str = ""
    #: The fixed frame of a published tree; empty for the robot's base.
    fixed: str = ""
    #: The search text for frame names.
    search: str = ""
    #: Whether a frame is open in the tree, for frames that the user opened or closed.
    is_open: dict[str, bool] = field(default_factory=dict)
    #: Whether a frame is shown, for frames that the user showed or hid. Applies to all frames
    #: below it that have no entry.
    is_shown: dict[str, bool] = field(default_factory=dict)
    #: Whether an owner's edges are shown.
    owners: dict[str, bool] = field(default_factory=dict)
    #: Whether a sensor's fields of view are shown.
    sensors: dict[str, bool] = field(default_factory=dict)
    #: The drawn length of fields of view in metres; None to derive it from the robot's size.
    reach: float | None = None
    #: Whether the camera uses parallel projection.
    is_parallel: bool = False
    #: Whether the scene shows the names of all frames.
    has_names: bool = False
    #: Whether blocked rays are shown.
    has_blocked: bool = False
    #: Whether mounts snap to mm and degrees.
    snaps: bool = True
    #: Joint positions, in rad or m.
    positions: dict[str, float] = field(default_factory=dict)
    #: The chosen time of a recording, in seconds after its first transform; None for the time of
    #: ``--at``.
    at_s: float | None = None
