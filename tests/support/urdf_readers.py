"""Four programs that read URDF, each behind the same two questions.

Where is every link, and how heavy are bodies?

Poses are 4×4 matrices of a link in the robot's base. A body is what cannot move in itself: mass in
kg, centre of mass in m and tensor in kg m² about it, in the axes of the link that it is asked for
by.
"""

from __future__ import annotations

import io
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import mujoco
import numpy as np
import pinocchio
import yourdfpy
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex

if TYPE_CHECKING:
    from collections.abc import Mapping

logging.getLogger("drake").setLevel(logging.ERROR)
logging.getLogger("yourdfpy").setLevel(logging.ERROR)

Matrix = Any


@dataclass(frozen=True)
class Body:
    """Mass, centre of mass and the tensor about it."""

    mass: float
    centre: Any
    tensor: Matrix

    def moved(self, pose: Matrix) -> Body:
        """Return the body in the axes of the pose's parent."""
        turned = pose[:3, :3]
        return Body(self.mass, turned @ self.centre + pose[:3, 3], turned @ self.tensor @ turned.T)


def together(bodies: list[Body]) -> Body:
    """Return what the bodies are when they are fixed to each other."""
    mass = sum(body.mass for body in bodies)
    if not mass:
        return Body(0.0, np.zeros(3), np.zeros((3, 3)))
    centre = sum(body.mass * body.centre for body in bodies) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        away = body.centre - centre
        tensor += body.tensor + body.mass * (away @ away * np.eye(3) - np.outer(away, away))
    return Body(mass, centre, tensor)


class Reader(Protocol):
    """A URDF that somebody else read.

    ``moving`` are the joints that it takes positions for, by URDF's name.
    """

    moving: set[str]

    def poses(self, positions: Mapping[str, float]) -> dict[str, Matrix]:
        """Return the pose of every link in the base, with joints at these positions or 0."""

    def bodies(self) -> dict[str, Body]:
        """Return bodies by the link in whose axes they are given."""


class Yourdfpy:
    """Python, on lxml, numpy and trimesh."""

    def __init__(self, urdf: str, base: str) -> None:
        self.base = base
        self.read = yourdfpy.URDF.load(io.StringIO(urdf), load_meshes=False)
        self.moving = set(self.read.actuated_joint_names)

    def poses(self, positions: Mapping[str, float]) -> dict[str, Matrix]:
        self.read.update_cfg({name: positions.get(name, 0.0) for name in self.moving})
        return {link: self.read.get_transform(link, self.base) for link in self.read.link_map}

    def bodies(self) -> dict[str, Body]:
        bodies = {}
        for name, link in self.read.link_map.items():
            if link.inertial:
                body = Body(link.inertial.mass, np.zeros(3), link.inertial.inertia)
                bodies[name] = (
                    body if link.inertial.origin is None else body.moved(link.inertial.origin)
                )
        return bodies


class Pinocchio:
    """C++, on urdfdom: the parser of ROS.

    It joins what is fixed together, and gives that as one body.
    """

    def __init__(self, urdf: str, base: str) -> None:
        self.base = base
        self.model = pinocchio.buildModelFromXML(urdf)
        self.data = self.model.createData()
        self.moving = {
            name
            for name, joint in zip(self.model.names, self.model.joints, strict=True)
            if joint.nv == 1
        }
        self.moving.discard("universe")
        self.links = [
            frame for frame in self.model.frames if frame.type == pinocchio.FrameType.BODY
        ]

    def poses(self, positions: Mapping[str, float]) -> dict[str, Matrix]:
        q = pinocchio.neutral(self.model)
        for name in self.moving:
            joint = self.model.joints[self.model.getJointId(name)]
            value = positions.get(name, 0.0)
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            )
        pinocchio.framesForwardKinematics(self.model, self.data, q)
        placed = {
            frame.name: self.data.oMf[self.model.getFrameId(frame.name)].homogeneous
            for frame in self.links
        }
        to_base = np.linalg.inv(placed[self.base])
        return {name: to_base @ pose for name, pose in placed.items()}

    def bodies(self) -> dict[str, Body]:
        named_bodies = {}
        for frame in self.links:
            inertia = self.model.inertias[frame.parentJoint]
            if (
                np.allclose(frame.placement.homogeneous, np.eye(4))
                and frame.parentJoint not in named_bodies
            ):
                named_bodies[frame.parentJoint] = (
                    frame.name,
                    Body(inertia.mass, inertia.lever, inertia.inertia),
                )
        return {name: body for name, body in named_bodies.values() if body.mass}


class MuJoCo:
    """C++, a parser of its own. The root is the world there, and has no mass."""

    def __init__(self, urdf: str, base: str, more: str = "") -> None:
        self.base = base
        settings = (
            f'<mujoco><compiler fusestatic="false" discardvisual="false" {more}/></mujoco></robot>'
        )
        self.model = mujoco.MjModel.from_xml_string(urdf.replace("</robot>", settings))
        self.data = mujoco.MjData(self.model)
        kinds = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}
        joints = [self.model.joint(index) for index in range(self.model.njnt)]
        self.moving = {joint.name for joint in joints if int(joint.type[0]) in kinds}

    def poses(self, positions: Mapping[str, float]) -> dict[str, Matrix]:
        mujoco.mj_resetData(self.model, self.data)
        for name in self.moving & set(positions):
            self.data.joint(name).qpos[0] = positions[name]
        mujoco.mj_kinematics(self.model, self.data)
        poses = {self.base: np.eye(4)}
        for index in range(1, self.model.nbody):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = self.data.xmat[index].reshape(3, 3), self.data.xpos[index]
            poses[self.model.body(index).name] = pose
        return poses

    def bodies(self) -> dict[str, Body]:
        bodies = {}
        for index in range(1, self.model.nbody):
            body = self.model.body(index)
            turned = np.zeros(9)
            mujoco.mju_quat2Mat(turned, body.iquat)
            rows = turned.reshape(3, 3)
            bodies[body.name] = Body(
                body.mass[0], np.array(body.ipos), rows @ np.diag(body.inertia) @ rows.T
            )
        return {name: body for name, body in bodies.items() if body.mass}


class Drake:
    """C++, a parser of its own on tinyxml2; it refuses tensors that no body can have."""

    def __init__(self, urdf: str, base: str) -> None:
        self.base = base
        self.plant = MultibodyPlant(0.0)
        (self.instance,) = Parser(self.plant).AddModelsFromString(urdf, "urdf")
        self.plant.WeldFrames(self.plant.world_frame(), self.plant.GetFrameByName(base))
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()
        joints = [
            self.plant.get_joint(JointIndex(int(i)))
            for i in self.plant.GetJointIndices(self.instance)
        ]
        moving = (joint for joint in joints if joint.type_name() in {"revolute", "prismatic"})
        self.joints: dict[str, Any] = {joint.name(): joint for joint in moving}
        self.moving = set(self.joints)

    def poses(self, positions: Mapping[str, float]) -> dict[str, Matrix]:
        for name, joint in self.joints.items():
            value = positions.get(name, 0.0)
            if joint.type_name() == "revolute":
                joint.set_angle(self.context, value)
            else:
                joint.set_translation(self.context, value)
        links = [self.plant.get_body(i) for i in self.plant.GetBodyIndices(self.instance)]
        return {
            b.name(): self.plant.EvalBodyPoseInWorld(self.context, b).GetAsMatrix4() for b in links
        }

    def bodies(self) -> dict[str, Body]:
        bodies = {}
        for index in self.plant.GetBodyIndices(self.instance):
            inertia = self.plant.get_body(index).CalcSpatialInertiaInBodyFrame(self.context)
            mass, centre = inertia.get_mass(), inertia.get_com()
            if mass > 0:
                about = inertia.Shift(centre).CalcRotationalInertia().CopyToFullMatrix3()
                bodies[self.plant.get_body(index).name()] = Body(mass, centre, about)
        return bodies
