"""Every frame is where the vendor's package has it.

Figures read apart from the presets, to 1e-9.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import yaml

from tfcompose.cli.compiling import library
from tfcompose.compiler.resolve.poses import rotation_of
from tfcompose.compiler.resolve.presets import fill_name
from tfcompose.foundation.geometry import IDENTITY_XYZW, OPTICAL_XYZW, angle_between, quat_from_rpy
from tfcompose.spec.language.preset import PresetFrame

FACTS: dict[str, dict[str, dict[str, Any]]] = yaml.safe_load(
    Path(__file__).with_name("facts.yaml").read_text("utf-8")
)
KNOWN = library()
#: The driver hangs it on the IMU's frame, the vendor's xacro on the gyroscope's optical one; the
#: place is the same.
DRIVER_S_WAY = {
    ("realsense/d455", "{name}_imu_optical_frame"),
    ("realsense/d585", "{name}_imu_optical_frame"),
}
#: The vendor turns it by 1.57 rad, or not at all in spite of its name: the preset has the optical
#: turn itself.
OPTICAL_HERE = {
    ("flir/blackfly-s", "{name}_color_optical_frame"),
    ("robotis/pi-camera", "{name}_rgb_optical_frame"),
    ("realsense/r200", "{name}_rgb_optical_frame"),
    ("realsense/r200", "{name}_depth_optical_frame"),
}


def variants(name: str) -> Iterator[dict[str, list[tuple[str, PresetFrame]]]]:
    """Yield the frames with each choice that the preset has.

    The parents that they may have, and where they are.
    """
    choices = {
        key: option.variants
        for key, option in KNOWN.get(name).options.items()
        if option.type == "choice"
    }
    for chosen in product(*choices.values()):
        preset = KNOWN.get(name, dict(zip(choices, chosen, strict=True)))
        frames_by_name = {}
        for pattern, frame in preset.frames.items():
            parents = [frame.parent, *([frame.by_driver.parent] if frame.by_driver else [])]
            named = fill_name(pattern, "{name}", preset.words)
            frames_by_name[named] = [
                (fill_name(parent, "{name}", preset.words), frame) for parent in parents
            ]
        yield frames_by_name


def is_there(frame: PresetFrame, fact: dict[str, Any], name: str, *, optical: bool) -> bool:
    """Whether the frame is where the vendor has it.

    What nobody says is unknown in the preset, and no zero.
    """
    if fact["xyz"] is None:
        return frame.xyz is None
    if (
        frame.xyz is None
        or max(abs(a - b) for a, b in zip(frame.xyz, fact["xyz"], strict=True)) > 1e-9
    ):
        return False
    rotation = rotation_of(frame, name) or IDENTITY_XYZW
    if fact["rpy"] is None:
        return True
    return angle_between(rotation, OPTICAL_XYZW if optical else quat_from_rpy(*fact["rpy"])) < 1e-9


@pytest.mark.parametrize(
    ("preset", "name"), [(preset, name) for preset, frames in FACTS.items() for name in frames]
)
def test_a_frame_is_where_the_package_of_its_vendor_has_it(preset: str, name: str) -> None:
    fact = FACTS[preset][name]
    placements = [frame for frames in variants(preset) for frame in frames.get(name, [])]
    assert placements, f"no {name}"
    hung = [frame for parent, frame in placements if parent == fact["parent"]]
    if (preset, name) in DRIVER_S_WAY:
        assert not hung
        return
    optical = (preset, name) in OPTICAL_HERE
    assert any(is_there(frame, fact, name, optical=optical) for frame in hung), [
        (parent, frame.xyz) for parent, frame in placements
    ]
