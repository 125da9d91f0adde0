"""Camera of a scene: named views of the whole scene, in perspective or parallel projection."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import viser

#: Vertical angles of view in radians: viser's default, and an angle so small that the picture
#: looks like a parallel projection. viser has no orthographic camera.
_WIDE_RAD, _PARALLEL_RAD = math.radians(75), math.radians(1)
#: Directions from the robot to the camera, by the names of views. x is forward, y is left
#: (REP-103). In views from above and from below, forward is up in the picture.
VIEWS = {
    "corner": (0.62, 0.62, 0.48),
    "front": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "top": (-1e-3, 0.0, 1.0),
    "bottom": (-1e-3, 0.0, -1.0),
}
#: The part of the picture that the scene fills.
_FILLED = 0.8


@dataclass(frozen=True, slots=True)
class Bounds:
    """The sphere around the contents of a scene."""

    #: The centre, an array of shape (3,) in metres.
    middle: Any
    #: The radius in metres.
    radius: float

    @classmethod
    def around(cls, points: Any, least_m: float) -> Bounds:
        """Return the bounds of points, shape (n, 3), with a margin of ``least_m`` metres."""
        least, most = points.min(axis=0), points.max(axis=0)
        return cls((least + most) / 2, float(np.linalg.norm(most - least)) / 2 + least_m)

    def position(self, view: str, *, is_parallel: bool = False) -> Any:
        """Return the camera position of a named view, in metres."""
        direction = np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
        angle = _PARALLEL_RAD if is_parallel else _WIDE_RAD
        return self.middle + direction * self.radius / _FILLED / math.sin(angle / 2)


def begin_at(server: viser.ViserServer | viser.ClientHandle, bounds: Bounds) -> None:
    """Place the camera of each new window so that the whole scene is visible."""
    server.initial_camera.look_at = bounds.middle
    server.initial_camera.position = bounds.position("corner")


def go_to(client: viser.ClientHandle, bounds: Bounds, view: str, *, is_parallel: bool) -> None:
    """Move the camera of a window to a named view."""
    camera = client.camera
    with client.atomic():
        camera.fov = _PARALLEL_RAD if is_parallel else _WIDE_RAD
        camera.position = bounds.position(view, is_parallel=is_parallel)
        camera.look_at = bounds.middle


def project(client: viser.ClientHandle, *, is_parallel: bool) -> None:
    """Switch the window between parallel and perspective projection, at the same size."""
    camera = client.camera
    angle = _PARALLEL_RAD if is_parallel else _WIDE_RAD
    nearer = math.tan(camera.fov / 2) / math.tan(angle / 2)
    with client.atomic():
        camera.position = camera.look_at + (camera.position - camera.look_at) * nearer
        camera.fov = angle
