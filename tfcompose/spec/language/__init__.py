"""The language of robot files, presets and calibration sections, as pydantic models.

Validation, JSON Schema and reference are all derived from the models. ``overlay`` merges sources.
``validate`` turns a source into a ``RobotSpec``.
"""

from tfcompose.spec.language.args import ArgSpec, ArgValue, BuildInputs, RosArguments
from tfcompose.spec.language.overlay import (
    as_part,
    compose,
    lay_over,
    profiles_in,
    set_value,
    with_includes,
)
from tfcompose.spec.language.pose import DIRECTIONS
from tfcompose.spec.language.recognition import is_recognized, load_named
from tfcompose.spec.language.robot_overlays import (
    find_overlay,
    load_robot_overlay,
    overlay_files,
    overlay_folder,
    overlay_path,
    robots_with_overlay,
)
from tfcompose.spec.language.validate import (
    Validated,
    levels_of,
    validate,
    validate_file,
    validate_preset,
)

__all__ = [
    "DIRECTIONS",
    "ArgSpec",
    "ArgValue",
    "BuildInputs",
    "RosArguments",
    "Validated",
    "as_part",
    "compose",
    "find_overlay",
    "is_recognized",
    "lay_over",
    "levels_of",
    "load_named",
    "load_robot_overlay",
    "overlay_files",
    "overlay_folder",
    "overlay_path",
    "profiles_in",
    "robots_with_overlay",
    "set_value",
    "validate",
    "validate_file",
    "validate_preset",
    "with_includes",
]
