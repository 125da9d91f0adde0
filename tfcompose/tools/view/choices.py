"""Selection and visibility chosen in a view, by name.

They outlive the panel, which is rebuilt when a file changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Choices:
    """Choices in the view. They may name frames, owners or sensors that are gone."""

    #: The selected frame; empty: none.
    selected: str = ""
    #: The frame in which poses are given; empty: each frame's parent.
    base: str = ""
    #: The frame from which a published tree is seen; empty: the robot's base.
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
    #: The drawn length of fields of view in metres; None: derived from the robot's size.
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
    #: The shown time of a recording, in seconds after its first transform; None: the time given at
    #: the start.
    at_s: float | None = None
