"""Changes of frame names and camera calibrations in messages other than TF."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import yaml
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosbags.typesys.store import Typestore

    from tfcompose.tools.rebag.recorded_topic import RecordedTopic

CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
#: Fields that contain a frame name, in headers and outside, as in nav_msgs/Odometry.
_FRAME_FIELDS = frozenset({"frame_id", "child_frame_id"})


class CameraInfoError(Exception):
    """Raised if a file contains no camera calibration; the message is a sentence."""


@dataclass(frozen=True, slots=True)
class CameraInfo:
    """A calibration of ROS's camera_calibration, in pixels (sensor_msgs/CameraInfo)."""

    width: int
    height: int
    distortion_model: str
    #: The distortion coefficients.
    d: tuple[float, ...]
    #: The 3×3 camera matrix, the 3×3 rectification matrix and the 3×4 projection matrix, row by
    #: row.
    k: tuple[float, ...]
    r: tuple[float, ...]
    p: tuple[float, ...]


def camera_info_in(text: str) -> CameraInfo:
    """Return the calibration in a file of camera_calibration or camera_info_manager.

    Raises:
        CameraInfoError: if the file contains none.
    """
    try:
        document = yaml.safe_load(text)
        return CameraInfo(
            width=_size(document, "image_width"),
            height=_size(document, "image_height"),
            distortion_model=str(document["distortion_model"]),
            d=_numbers(document, "distortion_coefficients", None),
            k=_numbers(document, "camera_matrix", 9),
            r=_numbers(document, "rectification_matrix", 9),
            p=_numbers(document, "projection_matrix", 12),
        )
    except yaml.YAMLError as error:
        raise CameraInfoError(f"it is no YAML: {' '.join(str(error).split())}") from None
    except KeyError as error:
        raise CameraInfoError(f"it has no {error.args[0]}") from None
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise CameraInfoError(str(error) or type(error).__name__) from None


def _size(document: Mapping[str, Any], name: str) -> int:
    size = int(document[name])
    if not 0 <= size < 2**32:
        raise ValueError(f"{name} is {size}")
    return size


def _numbers(document: Mapping[str, Any], name: str, count: int | None) -> tuple[float, ...]:
    numbers = tuple(map(float, document[name]["data"]))
    if count is not None and len(numbers) != count:
        raise ValueError(f"{name} has {len(numbers)} numbers, not {count}")
    return numbers


@dataclass
class MessageEditor:
    """Renames frames in messages, and replaces camera calibrations."""

    #: New names of frames, by old name.
    renames: Mapping[str, str]
    #: Calibrations by topic.
    camera_infos: Mapping[str, CameraInfo]
    #: Topics whose frames were not renamed, with their type, because the type has no definition.
    unknown: dict[str, str] = field(default_factory=dict)
    #: The number of changed messages, by topic.
    changed: Counter[str] = field(default_factory=Counter)

    def editor_of(self, channel: RecordedTopic) -> Callable[[bytes], bytes] | None:
        """Return a function that changes a message of the topic; None if no message changes.

        The function raises a ValueError for a message that it cannot decode.
        """
        info = self.camera_infos.get(channel.topic)
        if channel.type != CAMERA_INFO:
            info = None
        if info is None and not self.renames:
            return None
        codec = codec_of(channel)
        if codec is None:
            self.unknown[channel.topic] = channel.type
            return None
        if info is None and not codec.names_a_frame(channel.type):
            return None
        old_names = [name.encode() for name in self.renames]

        def edit(data: bytes) -> bytes:
            if info is None and not any(name in data for name in old_names):
                return data
            message = codec.decode(data, channel.type)
            changed = bool(self.renames) and codec.rename(message, channel.type, self.renames)
            changed = (info is not None and _set_camera_info(message, info)) or changed
            if not changed:
                return data
            self.changed[channel.topic] += 1
            return bytes(codec.store.serialize_cdr(message, channel.type))

        return edit


@dataclass(frozen=True, slots=True)
class Codec:
    """The definitions of a message type and of the types that it contains."""

    store: Typestore
    _has_frame: dict[str, bool] = field(default_factory=dict)

    def decode(self, data: bytes, type_: str) -> Any:
        """Return the message of this type.

        Raises:
            ValueError: if it is none.
        """
        try:
            return self.store.deserialize_cdr(data, type_)
        except Exception as error:  # the library raises anything on foreign bytes
            raise ValueError(str(error)) from error

    def names_a_frame(self, type_: str) -> bool:
        """Return whether messages of the type contain a frame name, at any depth."""
        if type_ not in self._has_frame:
            self._has_frame[type_] = False
            self._has_frame[type_] = any(
                name in _FRAME_FIELDS or (inner is not None and self.names_a_frame(inner))
                for name, inner in self._fields(type_)
            )
        return self._has_frame[type_]

    def rename(self, message: Any, type_: str, renames: Mapping[str, str]) -> bool:
        """Rename frames in a message; return whether the message changed."""
        changed = False
        for name, inner in self._fields(type_):
            value = getattr(message, name)
            if name in _FRAME_FIELDS and isinstance(value, str):
                new = renames.get(value.removeprefix("/"))
                if new is not None:
                    setattr(message, name, new)
                    changed = True
            elif inner is not None and self.names_a_frame(inner):
                elements = value if isinstance(value, list) else [value]
                for element in elements:
                    changed = self.rename(element, inner, renames) or changed
        return changed

    def _fields(self, type_: str) -> list[tuple[str, str | None]]:
        """Return the fields of a type, each with the type of the field or of its elements."""
        _, fields = self.store.fielddefs[type_]
        return [(name, _type_name(kind)) for name, kind in fields]


def codec_of(channel: RecordedTopic) -> Codec | None:
    """Return the definitions of a channel's messages, from the bag or from ROS 2 Jazzy.

    Return None if neither defines the type.
    """
    if channel.definition:
        store = get_typestore(Stores.EMPTY)
        try:
            if channel.encoding == "ros2idl":
                store.register(get_types_from_idl(channel.definition))
            else:
                store.register(get_types_from_msg(channel.definition, channel.type))
            store.generate_msgdef(channel.type, ros_version=2)
        except Exception:  # noqa: BLE001, S110 (the library's parser raises anything on a foreign text)
            pass
        else:
            return Codec(store)
    store = get_typestore(Stores.ROS2_JAZZY)
    return Codec(store) if channel.type in store.types else None


def _type_name(kind: Any) -> str | None:
    """Return the message type of a field, or of a sequence's elements; None for a basic type."""
    node, inner = kind
    name = getattr(node, "name", None)
    if name == "NAME":
        return str(inner)
    if name in {"ARRAY", "SEQUENCE"}:
        return _type_name(inner[0])
    return None


def _set_camera_info(message: Any, info: CameraInfo) -> bool:
    """Write the calibration into a CameraInfo; keep its header, binning and region."""
    import numpy as np  # noqa: PLC0415 (as the library has arrays)

    values: dict[str, Any] = {
        "width": info.width,
        "height": info.height,
        "distortion_model": info.distortion_model,
        **{name: np.array(getattr(info, name), float) for name in "dkrp"},
    }
    changed = any(
        not np.array_equal(getattr(message, name), value) for name, value in values.items()
    )
    for name, value in values.items():
        setattr(message, name, value)
    return changed
