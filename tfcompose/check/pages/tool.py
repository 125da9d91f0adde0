"""What tfcompose says of its surroundings and of itself."""

from __future__ import annotations

PAGES = {
    "TF901": """ROS 2 is missing, or cannot be used.""",
    "TF902": """A plan cannot be used: it is not one, not whole, or of another version.

Build it again.""",
    "TF903": """A rule crashed.

The other rules went on. This is a fault of tfcompose; please report it with the robot file.""",
    "TF904": """A xacro file is to be read, and xacro is not installed.

It comes with ROS, and from PyPI: pip install xacro.""",
    "TF905": """An inertia is to be computed from a mesh, and trimesh is not installed.

pip install 'tfcompose[mesh]', or give the inertia.""",
    "TF906": """A bag is to be read, and the package rosbags is not there.

pip install 'tfcompose[bag]' brings it. ROS is not needed to read bags.""",
    "TF907": """A bag cannot be read: it is not there, is damaged, is none of ROS 2, or holds no TF.

MCAP and SQLite bags are read, as folders with metadata.yaml or as single .mcap and .db3 files.""",
    "TF908": """A ROS process on this machine is set up so that it cannot be heard here.

Processes hear each other with the same ROS_DOMAIN_ID, where neither has ROS_AUTOMATIC_DISCOVERY_RANGE=OFF, and surely
only with the same RMW_IMPLEMENTATION. What a process was started with is read from /proc, for one's own processes; of
other machines, and of containers, it cannot be seen.""",
    "TF909": """Variables that set up ROS contradict each other, leave nobody to be heard, or say what cannot be.

A domain is a whole number from 0 to 232. RMW_IMPLEMENTATION names a middleware that has to be installed: ROS ends a
process that asks for another. ROS_LOCALHOST_ONLY=1 overrides ROS_AUTOMATIC_DISCOVERY_RANGE and is out of use since
Iron; OFF discovers nobody, not even on the same machine.""",
    "TF910": """A URDF that was to be written does not read back as the robot.

build --read-back reads each description with another parser and compares links, joints, poses, limits, masses and
shapes. Nothing is written then. It is a fault of tfcompose: report it, with the robot file.""",
}
