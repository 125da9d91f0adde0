"""Rays from the frame of a sensor's stream, and the robot's bodies that these rays hit.

All functions are pure functions of a ``Robot``. Boxes, cylinders, spheres and capsules need no
library; meshes need trimesh.
"""

from tfcompose.compiler.rays.bodies import PosedShape, Surroundings, sphere_around
from tfcompose.compiler.rays.cast import Ray, View, cast, reach_of, view_of
from tfcompose.compiler.rays.directions import contains, different_streams, directions, is_plane

__all__ = [
    "PosedShape",
    "Ray",
    "Surroundings",
    "View",
    "cast",
    "contains",
    "different_streams",
    "directions",
    "is_plane",
    "reach_of",
    "sphere_around",
    "view_of",
]
