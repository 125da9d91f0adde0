"""The robot: frames, edges, bodies, joints and processes, with every name, pose and owner decided.

A ``Robot`` can hold a wrong robot: two parents, a cycle or two owners are for a rule to report.
Lengths are metres, angles radians, rates hertz; an edge's pose is the pose of its child in its
parent. What only some robots have stands in ``hardware``, which is imported by that name.
"""

from tfcompose.model.robot.body import (
    Asset,
    Inertial,
    Link,
    Material,
    Shape,
    colour_name,
    materials,
)
from tfcompose.model.robot.edge import (
    BOUNDED,
    FREE,
    MOVING,
    Calibration,
    Dynamics,
    Edge,
    Joint,
    Limit,
    ReferencePositions,
    SafetyController,
)
from tfcompose.model.robot.optics import Optics, OpticsKind, OpticsSource, Projection, Shutter
from tfcompose.model.robot.process import (
    BUILT_IN,
    GUARD,
    JOINTS,
    ROS2_LAUNCH,
    SHELL,
    STATIC,
    AsInFile,
    Claim,
    Host,
    Node,
    Process,
)
from tfcompose.model.robot.robot import (
    OPTICAL_ENDINGS,
    MountedSensor,
    Part,
    Robot,
    SourceNumbers,
    Zone,
    is_optical,
    left_out_by,
    may_be_refused,
)

__all__ = [
    "BOUNDED",
    "BUILT_IN",
    "FREE",
    "GUARD",
    "JOINTS",
    "MOVING",
    "OPTICAL_ENDINGS",
    "ROS2_LAUNCH",
    "SHELL",
    "STATIC",
    "AsInFile",
    "Asset",
    "Calibration",
    "Claim",
    "Dynamics",
    "Edge",
    "Host",
    "Inertial",
    "Joint",
    "Limit",
    "Link",
    "Material",
    "MountedSensor",
    "Node",
    "Optics",
    "OpticsKind",
    "OpticsSource",
    "Part",
    "Process",
    "Projection",
    "ReferencePositions",
    "Robot",
    "SafetyController",
    "Shape",
    "Shutter",
    "SourceNumbers",
    "Zone",
    "colour_name",
    "is_optical",
    "left_out_by",
    "materials",
    "may_be_refused",
]
