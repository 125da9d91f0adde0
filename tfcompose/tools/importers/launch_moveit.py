"""Replacement of MoveIt's configuration builder for launch files.

The builder reads parameters from a MoveIt configuration package. File and parameter names are
those of MoveIt's source code. The import reports missing files.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.tools.importers.launch_objects import here
from tfcompose.tools.importers.launch_parameters import text_of
from tfcompose.tools.importers.launch_records import PACKAGE, FailedError, placeholder

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.tools.importers.launch_context import RecordingContext

#: The default file of each method of the builder, and the parameter that the method sets, if any.
_FILES = {
    "robot_description_kinematics": ("config/kinematics.yaml", "robot_description_kinematics"),
    "joint_limits": ("config/joint_limits.yaml", "robot_description_planning"),
    "pilz_cartesian_limits": ("config/pilz_cartesian_limits.yaml", "robot_description_planning"),
    "moveit_cpp": ("config/moveit_cpp.yaml", ""),
}
#: Parts that every MoveIt configuration has.
_USUAL = (
    "robot_description",
    "robot_description_semantic",
    "robot_description_kinematics",
    "planning_pipelines",
    "trajectory_execution",
    "planning_scene_monitor",
    "sensors_3d",
    "joint_limits",
)
#: Default values of the planning scene monitor's publishing parameters, in the builder's order.
_MONITOR = {
    "publish_planning_scene": True,
    "publish_geometry_updates": True,
    "publish_state_updates": True,
    "publish_transforms_updates": True,
    "publish_robot_description": False,
    "publish_robot_description_semantic": False,
}


class MoveItConfigs:
    """The configuration that the builder returns: mappings of parameters."""

    def __init__(self, package_path: str, parts: dict[str, dict[str, Any]]) -> None:
        self.package_path, self.parts = package_path, parts

    def __getattr__(self, name: str) -> dict[str, Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        part: dict[str, Any] = self.parts.get(name, {})
        return part

    def to_dict(self) -> dict[str, Any]:
        """Return all parameters."""
        every: dict[str, Any] = {}
        for part in self.parts.values():
            for key, value in part.items():
                entry = every.get(key)
                both = isinstance(entry, dict) and isinstance(value, dict)
                every[key] = {**entry, **value} if both else value  # type: ignore[dict-item]
        return every


class MoveItConfigsBuilder:
    """Builds configurations. ``find`` locates packages, and ``context`` collects missing files."""

    def __init__(
        self,
        find: Callable[[str], str],
        context: RecordingContext,
        robot_name: str = "",
        robot_description: str = "robot_description",
        *,
        package_name: str | None = None,
    ) -> None:
        self._find, self._context, self._name, self._key = (
            find,
            context,
            robot_name,
            robot_description,
        )
        self._folder = find(package_name or f"{robot_name}_moveit_config")
        self._parts: dict[str, dict[str, Any]] = {}

    def __getattr__(self, name: str) -> Callable[..., MoveItConfigsBuilder]:
        if name not in _FILES:
            raise AttributeError(name)
        usual, parameter = _FILES[name]

        def read(file_path: Any = None, **_more: Any) -> MoveItConfigsBuilder:
            values = self._read(str(file_path or usual))
            self._parts[name] = {parameter: values} if parameter and values else values
            return self

        return read

    def robot_description(
        self, file_path: Any = None, mappings: Any = None, **_more: Any
    ) -> MoveItConfigsBuilder:
        """Set the robot's description."""
        urdf = self._of_setup_assistant("urdf") or f"config/{self._name}.urdf.xacro"
        self._parts["robot_description"] = {self._key: self._text(file_path or urdf, mappings)}
        return self

    def robot_description_semantic(
        self, file_path: Any = None, mappings: Any = None, **_more: Any
    ) -> MoveItConfigsBuilder:
        """Set the robot's semantic description (SRDF)."""
        srdf = self._of_setup_assistant("srdf") or f"config/{self._name}.srdf"
        self._parts["robot_description_semantic"] = {
            f"{self._key}_semantic": self._text(file_path or srdf, mappings)
        }
        return self

    def planning_scene_monitor(self, *args: Any, **more: Any) -> MoveItConfigsBuilder:
        """Set the publishing parameters of the planning scene monitor."""
        self._parts["planning_scene_monitor"] = {
            **_MONITOR,
            **dict(zip(_MONITOR, args, strict=False)),
            **more,
        }
        return self

    def trajectory_execution(
        self, file_path: Any = None, moveit_manage_controllers: Any = None, **_more: Any
    ) -> MoveItConfigsBuilder:
        """Set the controllers.

        Without a file, use a file of the package whose name contains controllers.
        """
        names = [
            file.name.removesuffix("_controllers.yaml")
            for file in self._config("*_controllers.yaml")
        ]
        first = (
            names
            if len(names) == 1
            else [name for name in ("moveit", "moveit2", self._name) if name in names]
        )
        file = file_path or (f"config/{first[0]}_controllers.yaml" if first else None)
        values = {"moveit_manage_controllers": moveit_manage_controllers is not False}
        self._parts["trajectory_execution"] = values | (self._read(str(file)) if file else {})
        return self

    def sensors_3d(self, file_path: Any = None, **_more: Any) -> MoveItConfigsBuilder:
        """Set the sensors of the planning scene, if a file lists sensors."""
        config = self._config("sensors_3d.yaml")
        values = self._read(str(file_path or config[0])) if file_path or config else {}
        sensors = values.get("sensors")
        self._parts["sensors_3d"] = (
            values if sensors and isinstance(sensors, list) and sensors[0] else {}
        )
        return self

    def _config(self, pattern: str) -> list[Path]:
        """Return the configuration files that match a pattern, in order."""
        return (
            sorted(Path(self._folder, "config").glob(pattern))
            if Path(self._folder).is_dir()
            else []
        )

    def planning_pipelines(
        self, default_planning_pipeline: Any = None, pipelines: Any = None, **_more: Any
    ) -> MoveItConfigsBuilder:
        """Set the planners; without names, use all planners with a file in the package."""
        names = list(pipelines or ())
        if not names:
            names = [
                file.name.removesuffix("_planning.yaml")
                for file in self._config("*_planning.yaml")
            ]
            self._context.todo(
                here(), "planning pipelines that are MoveIt's own, beside the package's"
            )
        names = names or ["ompl"]
        first = default_planning_pipeline or ("ompl" if "ompl" in names else names[0])
        values: dict[str, Any] = {"planning_pipelines": names, "default_planning_pipeline": first}
        self._parts["planning_pipelines"] = values | {
            pipeline: self._read(f"config/{pipeline}_planning.yaml") for pipeline in names
        }
        return self

    def to_moveit_configs(self) -> MoveItConfigs:
        """Return the configuration, with MoveIt's defaults for parts that were not set."""
        for name in _USUAL:
            if name not in self._parts:
                getattr(self, name)()
        has_pilz = "pilz_industrial_motion_planner" in self._parts["planning_pipelines"]
        if has_pilz and "pilz_cartesian_limits" not in self._parts:
            self.pilz_cartesian_limits()
        return MoveItConfigs(self._folder, self._parts)

    def to_dict(self, **_more: Any) -> dict[str, Any]:
        """Return all parameters."""
        return self.to_moveit_configs().to_dict()

    def _of_setup_assistant(self, kind: str) -> str:
        """Return the file of a kind that the setup assistant recorded; empty if there is none."""
        file = Path(self._folder) / ".setup_assistant"
        if not file.is_file():
            return ""
        config = (yaml.safe_load(file.read_text("utf-8")) or {}).get(
            "moveit_setup_assistant_config", {}
        )
        section = config.get(kind) or config.get(kind.upper()) or {}
        relative = section.get("relative_path", "")
        package = section.get("package", "")
        return f"{self._find(package)}/{relative}" if package and relative else relative

    def _text(self, file: Any, mappings: Any) -> str:
        path = str(file) if str(file).startswith(("/", PACKAGE)) else f"{self._folder}/{file}"
        args: dict[str, str] = {}
        for name, value in dict(mappings or {}).items():
            try:
                args[str(name)] = text_of(value, self._context)
            except FailedError as error:
                self._context.todo(here(), f"the argument {name} of {path}: {error}")
        return placeholder(path, args)

    def _read(self, file: str) -> dict[str, Any]:
        path = file if file.startswith("/") else f"{self._folder}/{file}"
        if path.startswith(PACKAGE):
            return {}
        try:
            values = yaml.safe_load(Path(path).read_text("utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError):
            self._context.todo(here(), f"parameters of {path}, which cannot be read")
            return {}
        return values if isinstance(values, dict) else {}
