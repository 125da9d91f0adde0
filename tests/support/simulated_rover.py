"""A rover in MuJoCo that drives past boxes and walls, with sensors at their true mounts.

MuJoCo's own accelerometer, gyroscope and ray casts measure; nothing here knows how tfcompose
computes. Noise is that of data sheets: a MEMS IMU (150 µg/√Hz, 20 mg, 0.015 deg/s/√Hz), a lidar
(15 mm), a stereo camera (error grows with the square of the distance), and wheels that slip.

``python -m tests.support.simulated_rover`` writes the small recording that is kept, ``RECORDING``.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import CompressionMode
from scipy.spatial.transform import Rotation

from tests.support.bags import header, message, write_bag

Array = NDArray[np.float64]
STEP_S = 0.002
#: For so long a route leads straight ahead.
STRAIGHT_S = 6.0
OPTICAL = Rotation.from_euler("xyz", [-90, 0, -90], degrees=True)


@dataclass(frozen=True)
class Mount:
    """A pose in base_link: metres, and roll, pitch and yaw about fixed axes in degrees."""

    xyz: tuple[float, float, float]
    rpy_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> Rotation:
        return Rotation.from_euler("xyz", self.rpy_deg, degrees=True)

    @property
    def yaml(self) -> str:
        angles = ", ".join(f"{angle} deg" for angle in self.rpy_deg)
        return f"xyz: {list(self.xyz)}, rpy: [{angles}]"


#: base_link is 0.2 m above the floor.
HEIGHT = 0.2
MOUNTS = {
    "imu": Mount((0.05, 0.02, 0.03)),
    "front": Mount((0.3, 0.2, 0.4)),
    "rear": Mount((-0.25, -0.2, 0.3), (0.0, 0.0, 180.0)),
    "camera": Mount((0.35, 0.0, 0.25), (0.0, 20.0, 0.0)),
}
#: The frames in the headers of messages.
FRAMES = {name: f"{name}_link" for name in MOUNTS} | {"camera": "camera_optical_frame"}
#: Ten seconds of all sensors, with the mounts and frames above.
RECORDING = Path(__file__).parents[1] / "tools" / "prove" / "rover.mcap"


def robot_file(mounts: dict[str, Mount] = MOUNTS, parent: str = "base_link") -> str:
    """Return the rover's robot file; ``parent`` is that of the camera."""
    return f"""\
tfcompose: 1
robot: rover
frames:
  odom: {{}}
  base_footprint: {{parent: odom, owner: drive, rate: 20 Hz}}
  base_link: {{parent: base_footprint, xyz: [0, 0, {HEIGHT}]}}
  camera_link: {{parent: {parent}, {mounts["camera"].yaml}}}
  camera_optical_frame: {{parent: camera_link, rpy: [-90 deg, 0, -90 deg]}}
sensors:
  imu: {{preset: generic/imu, parent: base_link, {mounts["imu"].yaml}}}
  front: {{preset: generic/lidar3d, parent: base_link, {mounts["front"].yaml}}}
  rear: {{preset: generic/lidar3d, parent: base_link, {mounts["rear"].yaml}}}
processes:
  drive: {{external: true, node: diff_drive}}
"""


class Route:
    """Speeds over time: m/s forward and rad/s to the left."""

    def __init__(self, seed: int, *, moves: bool) -> None:
        generator = np.random.default_rng(seed)
        self._phases = generator.uniform(0, 2 * math.pi, 2)
        self._periods = generator.uniform(7.0, 11.0, 2)
        self._side = generator.choice([-1.0, 1.0])
        self._moves = moves

    def speeds_at(self, time_s: float) -> tuple[float, float]:
        """Return the speeds at a time: from rest straight ahead, then curves within 3 m of it."""
        if not self._moves:
            return 0.0, 0.0
        if time_s < STRAIGHT_S:
            return 0.6 * min(1.0, max(0.0, time_s - 1.0)), 0.0
        swing, curve = (
            math.sin(2 * math.pi * time_s / period + phase)
            for period, phase in zip(self._periods, self._phases, strict=True)
        )
        return 0.4 + 0.3 * swing, self._side * (0.4 + 0.4 * curve)


@dataclass
class Measured:
    """What the sensors measured: rows by time, and clouds (time, points in the sensor)."""

    imu: list[tuple[float, Array, Array]] = field(default_factory=list)
    odometry: list[tuple[float, float, float, float]] = field(default_factory=list)
    clouds: dict[str, list[tuple[float, Array]]] = field(default_factory=dict)


def _model(mounts: dict[str, Mount], seed: int) -> Any:
    """Return a room of 12 by 10 m with boxes, and the rover with a site for each sensor."""
    generator = np.random.default_rng(seed)
    boxes = []
    for index in range(10):
        x, y = generator.uniform(-5.0, 5.0), generator.uniform(3.6, 4.8)
        y *= generator.choice([-1.0, 1.0])
        size = generator.uniform(0.15, 0.5, 3)
        yaw = generator.uniform(0, 90)
        boxes.append(
            f'<geom name="box{index}" type="box" pos="{x} {y} {size[2]}" euler="0 0 {yaw}"'
            f' size="{size[0]} {size[1]} {size[2]}" group="0"/>'
        )
    walls = [
        f'<geom type="box" pos="{x} {y} 1" size="{a} {b} 1" group="0"/>'
        for x, y, a, b in ((7, 0, 0.1, 5), (-7, 0, 0.1, 5), (0, 5.2, 7, 0.1), (0, -5.2, 7, 0.1))
    ]
    sites = "".join(
        f'<site name="{name}" pos="{mount.xyz[0]} {mount.xyz[1]} {mount.xyz[2]}"'
        f' quat="{" ".join(map(str, mount.rotation.as_quat(scalar_first=True)))}"/>'
        for name, mount in mounts.items()
    )
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler angle="degree"/><option timestep="{STEP_S}" gravity="0 0 -9.80665"/>
        <worldbody><geom type="plane" size="20 20 1" group="0"/>{"".join(boxes)}{"".join(walls)}
        <body name="base" pos="-3 0 {HEIGHT}"><joint type="slide" axis="1 0 0"/>
        <joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>
        <geom type="box" size=".3 .2 .1" mass="30" group="3" contype="0" conaffinity="0"/>
        {sites}</body></worldbody>
        <sensor><accelerometer site="imu"/><gyro site="imu"/></sensor></mujoco>"""
    )


def _rays(name: str) -> Array:
    """Return the directions of a sensor's rays in its own axes, shape (n, 3)."""
    if name == "camera":  # in the body's axes: x forward
        across, down = np.meshgrid(np.tan(np.radians(np.linspace(-40, 40, 48))),
                                   np.tan(np.radians(np.linspace(-28, 28, 36))))  # fmt: skip
        rays = np.column_stack([np.ones(across.size), -across.ravel(), -down.ravel()])
    else:
        azimuths, elevations = np.meshgrid(
            np.radians(np.arange(-180, 180, 2.0)), np.radians(np.linspace(-25, 15, 16))
        )
        rays = np.column_stack(
            [
                (np.cos(elevations) * np.cos(azimuths)).ravel(),
                (np.cos(elevations) * np.sin(azimuths)).ravel(),
                np.sin(elevations).ravel(),
            ]
        )
    directions: Array = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return directions


def simulate(
    mounts: dict[str, Mount] = MOUNTS,
    *,
    seed: int = 0,
    moves: bool = True,
    seconds: float = 30.0,
    cloud_rate: float = 5.0,
) -> Measured:
    """Drive, and return what the sensors measure at these true mounts."""
    model = _model(mounts, seed)
    data = mujoco.MjData(model)
    noise, route = np.random.default_rng([seed, 1]), Route(seed, moves=moves)
    measured = Measured()
    force_bias, rate_bias = noise.normal(0, 0.1, 3), noise.normal(0, 0.002, 3)
    slip, slip_yaw = noise.normal(1.0, 0.01), noise.normal(1.0, 0.03)
    every_cloud = round(1 / cloud_rate / STEP_S) if cloud_rate else 0
    for step in range(round(seconds / STEP_S)):
        now_s = step * STEP_S
        speed, rate = route.speeds_at(now_s)
        yaw = data.qpos[2]
        target = np.array([speed * math.cos(yaw), speed * math.sin(yaw), rate])
        data.qfrc_applied[:] = (target - data.qvel) * np.array([900.0, 900.0, 60.0])
        mujoco.mj_step(model, data)
        if step % 5 == 0:
            scale = 9.80665 * 150e-6 * math.sqrt(50)
            force = data.sensordata[:3] + force_bias + noise.normal(0, scale, 3)
            rates = data.sensordata[3:] + rate_bias
            rates = rates + noise.normal(0, math.radians(0.015) * math.sqrt(50), 3)
            measured.imu.append((now_s, force, rates))
        if step % 10 == 0:
            yaw = data.qpos[2]
            forward = data.qvel[0] * math.cos(yaw) + data.qvel[1] * math.sin(yaw)
            left = -data.qvel[0] * math.sin(yaw) + data.qvel[1] * math.cos(yaw)
            wheels = noise.normal(0, [0.01, 0.0, 0.01]) if moves else np.zeros(3)
            measured.odometry.append(
                (
                    now_s,
                    forward * slip + wheels[0],
                    left * 0.0,
                    data.qvel[2] * slip_yaw + wheels[2],
                )
            )
        if every_cloud and step % every_cloud == 0:
            for name in mounts:
                if name != "imu":
                    points = _cast(model, data, name, noise)
                    measured.clouds.setdefault(name, []).append((now_s, points))
    return measured


def _cast(model: Any, data: Any, name: str, noise: np.random.Generator) -> Array:
    """Return the points that a sensor sees, in its own axes."""
    mujoco.mj_kinematics(model, data)
    site = data.site(name)
    rotation, rays = site.xmat.reshape(3, 3), _rays(name)
    distances, geoms = np.zeros(len(rays)), np.zeros(len(rays), dtype=np.int32)
    groups = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)
    mujoco.mj_multiRay(
        model, data, site.xpos, (rays @ rotation.T).ravel(), groups, 1, -1, geoms, distances, None,
        len(rays), 12.0,
    )  # fmt: skip
    sees = geoms >= 0
    scale = 0.004 * distances[sees] ** 2 if name == "camera" else 0.015
    ranges = distances[sees] + noise.normal(0, 1, int(sees.sum())) * scale
    return rays[sees] * ranges[:, None]


def vector(values: Any) -> Any:
    x, y, z = map(float, values)
    return message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def imu_message(at_s: float, frame: str, force: Any, rates: Any) -> Any:
    upright = message("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    return message(
        "sensor_msgs/msg/Imu",
        header=header(at_s, frame),
        orientation=upright,
        orientation_covariance=np.zeros(9),
        angular_velocity=vector(rates),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector(force),
        linear_acceleration_covariance=np.zeros(9),
    )


def odometry_message(at_s: float, forward: float, left: float, rate: float) -> Any:
    point = message("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    upright = message("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    twist = message(
        "geometry_msgs/msg/Twist", linear=vector((forward, left, 0)), angular=vector((0, 0, rate))
    )
    return message(
        "nav_msgs/msg/Odometry",
        header=header(at_s, "odom"),
        child_frame_id="base_link",
        pose=message(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=message("geometry_msgs/msg/Pose", position=point, orientation=upright),
            covariance=np.zeros(36),
        ),
        twist=message(
            "geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)
        ),
    )


def cloud_message(at_s: float, frame: str, points: Array) -> Any:
    fields = [
        message("sensor_msgs/msg/PointField", name=name, offset=4 * index, datatype=7, count=1)
        for index, name in enumerate("xyz")
    ]
    data = points.astype("<f4").tobytes()
    return message(
        "sensor_msgs/msg/PointCloud2",
        header=header(at_s, frame),
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(points),
        data=np.frombuffer(data, dtype=np.uint8),
        is_dense=True,
    )


def messages_of(measured: Measured, frames: dict[str, str]) -> list[tuple[str, float, str, Any]]:
    """Return topic, time, type and message of all measurements, in order of time."""
    sent = [
        ("/imu", at_s, "sensor_msgs/msg/Imu", imu_message(at_s, frames["imu"], force, rates))
        for at_s, force, rates in measured.imu
    ]
    sent += [
        ("/odom", at_s, "nav_msgs/msg/Odometry", odometry_message(at_s, *speeds))
        for at_s, *speeds in measured.odometry
    ]
    for name, clouds in measured.clouds.items():
        for at_s, points in clouds:
            final = points @ OPTICAL.as_matrix() if name == "camera" else points
            sent.append(
                (
                    f"/{name}/points",
                    at_s,
                    "sensor_msgs/msg/PointCloud2",
                    cloud_message(at_s, frames[name], final),
                )
            )
    return sorted(sent, key=lambda each: each[1])


def thinned(measured: Measured) -> Measured:
    """Return half of the IMU's samples and a sixth of the points, rounded, to keep them small."""
    return Measured(
        [
            (at_s, np.round(force, 4), np.round(rates, 5))
            for at_s, force, rates in measured.imu[::2]
        ],
        measured.odometry,
        {
            name: [(at_s, np.round(points[::6], 3)) for at_s, points in clouds]
            for name, clouds in measured.clouds.items()
        },
    )


def main() -> None:
    """Write the small recording."""
    measured = thinned(simulate(seed=11, seconds=10, cloud_rate=2))
    with tempfile.TemporaryDirectory() as folder:
        bag = write_bag(
            Path(folder, RECORDING.stem),
            compressed=CompressionMode.STORAGE,
            messages=messages_of(measured, FRAMES),
        )
        RECORDING.write_bytes((bag / RECORDING.name).read_bytes())


if __name__ == "__main__":
    main()
