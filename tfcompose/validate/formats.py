"""How the formats of calibration files are told apart and read; see ``tfcompose.validate.calibration``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tfcompose.pose import Pose, quat_from_rpy
from tfcompose.validate.entries import Entries, RefusedError
from tfcompose.validate.schema import shown

if TYPE_CHECKING:
    from tfcompose.load import Path, Source
    from tfcompose.load.calibration import Form

AUTOWARE_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
_CAMERA = re.compile(r"cam(\d+)\Z")


def recognised(kind: Form, documents: tuple[Source, ...]) -> str | None:
    """Return the format that the documents look like, or None."""
    if kind != "yaml":
        return {"rows": "matrix", "launch": "moveit"}[kind]
    data: Any = documents[0].data if documents else None
    if isinstance(data, list):
        return "matrix" if data and all(isinstance(row, list) for row in data) else None
    if not isinstance(data, dict):
        return None
    if "transforms" in data or {"transform", "header"} <= set(data):
        return "transform_stamped"
    if {"transform", "transformation"} & set(data):
        return "easy_handeye2"
    inner = [value for value in data.values() if isinstance(value, dict)]
    if any(map(_CAMERA.match, data)) and inner:
        return "kalibr"
    leaves = [leaf for child in inner for leaf in child.values() if isinstance(leaf, dict)]
    return "autoware" if any(set(AUTOWARE_KEYS) & set(leaf) for leaf in leaves) else None


@dataclass(slots=True)
class Reader(Entries):
    """Reads documents in each of the formats."""

    def read(self, source: Source, form: str) -> None:
        """Read one document in the format."""
        by_format = {
            "autoware": self._autoware,
            "easy_handeye2": self._handeye,
            "moveit": self._launch,
            "kalibr": self._kalibr,
            "matrix": self._plain_matrix,
            "transform_stamped": self._messages,
        }
        try:
            by_format[form](source)
        except RefusedError:
            return

    def _autoware(self, source: Source) -> None:
        for parent, children in source.data.items() if isinstance(source.data, dict) else ():
            for child, values in children.items() if isinstance(children, dict) else ():
                path = (parent, child)
                try:
                    x, y, z, *rpy = self.vector(source, values, path, AUTOWARE_KEYS)
                except RefusedError:
                    continue
                self.add(source, path, Pose((x, y, z), quat_from_rpy(*rpy)), (parent.lstrip("/"), child.lstrip("/")))

    def _handeye(self, source: Source) -> None:
        data: Any = source.data
        at: Path = ("parameters",) if isinstance(data, dict) and "parameters" in data else ()
        said = self.get(source, data, (), "parameters") if at else data
        in_hand = said.get("eye_on_hand") if isinstance(said, dict) else None
        if in_hand is None:
            in_hand = self.get(source, said, at, "calibration_type") in {"eye_in_hand", "eye_on_hand"}
        parent = self.name(source, said, at, "robot_effector_frame" if in_hand else "robot_base_frame")
        child = self.name(source, said, at, "tracking_base_frame")
        if "transformation" in data:
            values = data["transformation"]
            x, y, z, *quat = self.vector(source, values, ("transformation",), ("x", "y", "z", "qx", "qy", "qz", "qw"))
            turned = self.unit(tuple(quat), source, ("transformation",))
            self.add(source, ("transformation",), Pose((x, y, z), turned), (parent, child))
        else:
            self.add(source, ("transform",), self._transform(source, data, ()), (parent, child))

    def _transform(self, source: Source, data: Any, path: Path) -> Pose:
        """Return what a geometry_msgs/Transform under the key ``transform`` says."""
        at = (*path, "transform")
        values = self.get(source, data, path, "transform")
        xyz = self.vector(source, self.get(source, values, at, "translation"), (*at, "translation"))
        rotation = self.get(source, values, at, "rotation")
        quat = self.vector(source, rotation, (*at, "rotation"), ("x", "y", "z", "w"))
        return Pose(xyz, self.unit(quat, source, (*at, "rotation")))

    def _messages(self, source: Source) -> None:
        data: Any = source.data
        many = isinstance(data, dict) and "transforms" in data
        listed: Any = data["transforms"] if many else [data]
        if not isinstance(listed, list):
            raise self.refuse(source, ("transforms",), f"{shown(listed)} is no list of transforms")
        for index, message in enumerate(listed):
            path: Path = ("transforms", index) if many else ()
            try:
                parent = self.name(source, message, path, "header", "frame_id")
                child = self.name(source, message, path, "child_frame_id")
                self.add(source, path, self._transform(source, message, path), (parent, child))
            except RefusedError:
                continue

    def _kalibr(self, source: Source) -> None:
        for camera, values in source.data.items() if isinstance(source.data, dict) else ():
            number = _CAMERA.match(camera)
            if not number or not isinstance(values, dict):
                continue
            before = f"cam{int(number[1][:9]) - 1}"
            for what, child in (("T_cam_imu", "imu"), ("T_cn_cnm1", before)):
                if what in values:
                    path = (camera, what)
                    try:
                        pose = self.matrix(values[what], source, path)
                    except RefusedError:
                        continue
                    self.add(source, path, pose, (camera, child), what)

    def _plain_matrix(self, source: Source) -> None:
        self.add(source, (), self.matrix(source.data, source, ()), (None, None))

    def _launch(self, source: Source) -> None:
        nodes: Any = source.data
        for index, words in enumerate(nodes):
            try:
                if any(word.startswith("--") for word in words):
                    self._flags(source, index, words)
                else:
                    self._positions(source, index, words)
            except RefusedError:
                continue

    def _positions(self, source: Source, index: int, words: list[str]) -> None:
        """Read x y z qx qy qz qw parent child."""
        if len(words) == 8:  # noqa: PLR2004 (x y z, three angles, two names)
            message = "three angles: the first versions of MoveIt wrote them in another order than their reader takes"
            raise self.refuse(source, (index,), message, "write the quaternion: x y z qx qy qz qw parent child")
        if len(words) != 9:  # noqa: PLR2004 (x y z, quaternion, two names)
            message = f"{len(words)} arguments; x y z qx qy qz qw parent child are expected"
            raise self.refuse(source, (index,), message)
        values = [self.number(word, source, (index, i)) for i, word in enumerate(words[:7])]
        turned = self.unit(tuple(values[3:]), source, (index,))
        names = (words[7].lstrip("/"), words[8].lstrip("/"))
        self.add(source, (index,), Pose((values[0], values[1], values[2]), turned), names)

    def _flags(self, source: Source, index: int, words: list[str]) -> None:
        """Read --x … --qw or --roll --pitch --yaw, --frame-id and --child-frame-id."""
        given = dict(zip(words[::2], words[1::2], strict=False))
        for name in ("--frame-id", "--child-frame-id"):
            if name not in given:
                raise self.refuse(source, (index,), f"{name} is missing", "it must be a text, not a variable")
        where = {word: (index, 2 * at + 1) for at, word in enumerate(words[::2])}

        def number(flag: str) -> float:
            return self.number(given[flag], source, where[flag]) if flag in given else float(flag == "--qw")

        xyz = (number("--x"), number("--y"), number("--z"))
        if {"--qx", "--qy", "--qz", "--qw"} & set(given):
            turned = (number("--qx"), number("--qy"), number("--qz"), number("--qw"))
            quat = self.unit(turned, source, (index,))
        else:
            quat = quat_from_rpy(number("--roll"), number("--pitch"), number("--yaw"))
        self.add(
            source, (index,), Pose(xyz, quat), (given["--frame-id"].lstrip("/"), given["--child-frame-id"].lstrip("/"))
        )
