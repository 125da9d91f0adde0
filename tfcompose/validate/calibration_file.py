"""What a calibration file says: poses with a direction and a place.

Every entry is the pose of its ``child`` in its ``parent``. Sources of the formats:

- autoware: ``sensors_calibration.yaml`` of a sensor kit, parent: {child: {x, y, z, roll, pitch, yaw}}, metres and
  radians about fixed axes, as xacro puts them into a joint's origin.
- easy_handeye2: its HandeyeCalibration message as YAML; the parent is robot_effector_frame for eye_in_hand, else
  robot_base_frame, the child is tracking_base_frame. Its first version and easy_handeye wrote ``transformation``.
- moveit: the launch file that "Save camera pose" writes, with one static_transform_publisher.
- kalibr: camchain and imucam files. ``T_cam_imu`` takes points from the IMU to the camera, so it is the pose of the IMU
  in the camera; ``T_cn_cnm1`` of cam1 takes points from cam0 to cam1: the pose of cam0 in cam1.
- transform_stamped: geometry_msgs/TransformStamped and tf2_msgs/TFMessage: the pose of child_frame_id in frame_id.
- matrix: four rows of four numbers that take points from the child to the parent; it has no names.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Span, finding
from tfcompose.load.calibration import load_calibration
from tfcompose.validate.calibration import FORMATS
from tfcompose.validate.formats import Reader, recognised

if TYPE_CHECKING:
    from tfcompose.validate.entries import Entry


@dataclass(frozen=True, slots=True)
class CalibrationFile:
    """What a calibration file says; ``found`` holds what is wrong with it, at its places."""

    file: str
    format: str
    entries: tuple[Entry, ...]
    found: tuple[Diagnostic, ...]


def read_calibration(text: str, file: str, form: str = "auto") -> CalibrationFile:
    """Return what the text says, read in the format; ``auto`` recognises it.

    Raises:
        RejectedError: if the text is not one that can be read at all.
    """
    kind, documents = load_calibration(text, file)
    wrong = [one for document in documents for one in document.found]
    if wrong:
        refused = (finding("TF610", one.message, one.span, help=one.help, notes=one.notes) for one in wrong)
        return CalibrationFile(file, form, (), tuple(refused))
    known = recognised(kind, documents)
    chosen = known if form == "auto" else form
    if chosen is None or not documents:
        what = "is empty" if not documents else "is in no format that is known"
        advice = f"formats: {', '.join(FORMATS)}; format: names one"
        return CalibrationFile(file, form, (), (finding("TF611", what, Span(file), help=advice),))
    if chosen != known and (kind != "yaml" or chosen == "moveit"):
        advice = f"leave format out; it reads like {known}" if known else f"formats: {', '.join(FORMATS)}"
        return CalibrationFile(file, chosen, (), (finding("TF611", f"is no {chosen} file", Span(file), help=advice),))
    reader = Reader()
    for document in documents:
        reader.read(document, chosen)
    if not reader.entries and not reader.found:
        reader.found.append(finding("TF611", f"holds no pose, read as {chosen}", Span(file)))
    return CalibrationFile(file, chosen, tuple(reader.entries), tuple(reader.found))
