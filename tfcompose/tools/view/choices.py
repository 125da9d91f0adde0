"""Selection and visibility chosen in a view, by name.

It outlives the panel, which is rebuilt when a file changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Choices:
    """Choices in the view; they may name frames, owners or sensors that are gone.

    Attributes:
        selected: the selected frame; empty: none was.
        base: the frame in which poses are given; empty: each frame's parent.
        fixed: the frame from which a published tree is seen; empty: the base of the robot.
        search: what names of frames are searched for.
        is_open: frames of the tree that were opened or closed.
        is_shown: frames that were shown or hidden, with all below them that were not themselves.
        owners: owners whose edges were shown or hidden.
        sensors: sensors whose fields of view were shown or hidden.
        reach: how far fields of view are drawn, in metres; None: as suits the robot.
        is_parallel: whether the camera shows parallel lines as parallel.
        has_names: whether the names of all frames are shown in the scene.
        has_blocked: whether blocked rays are shown.
        snaps: whether mounts snap to mm and degrees.
        positions: where joints are, in rad or m.
        at_s: the time of a recording that is shown, in seconds after its begin; None: as given.
    """

    selected: str = ""
    base: str = ""
    fixed: str = ""
    search: str = ""
    is_open: dict[str, bool] = field(default_factory=dict)
    is_shown: dict[str, bool] = field(default_factory=dict)
    owners: dict[str, bool] = field(default_factory=dict)
    sensors: dict[str, bool] = field(default_factory=dict)
    reach: float | None = None
    is_parallel: bool = False
    has_names: bool = False
    has_blocked: bool = False
    snaps: bool = True
    positions: dict[str, float] = field(default_factory=dict)
    at_s: float | None = None
