"""Clearpath's ``robot.yaml`` and Autoware's calibration files, as drafts of robot files.

Clearpath's generator calls a xacro macro of its packages for the platform and for each attachment,
mount, sensor and manipulator (source: clearpath_common and clearpath_config). The imported robot
file has a part for each of these calls, with the same macro and the same name.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.foundation.reading import is_file, is_folder, names_in
from tfcompose.tools.importers.draft import pose_keys, where
from tfcompose.tools.importers.texts import Argument, Text, concatenate
from tfcompose.tools.importers.yaml_text import ExpressionText

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping
    from pathlib import Path

    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.files import Target
    from tfcompose.spec.load import Path as Steps
    from tfcompose.spec.load import Source
    from tfcompose.tools.importers.draft import ImportDraft

_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
#: Clearpath's mounts whose macros are in a separate folder.
_PACS = frozenset({"bracket", "riser"})
#: A file that all macros need. The robot of Clearpath's generator also includes it.
_COMMON = "package://clearpath_platform_description/urdf/common.urdf.xacro"
#: Keys of an entry that are not parameters of the macro.
_OF_CALL = frozenset({"parent", "xyz", "rpy", "name", "type", "enabled", "urdf_enabled"})
_LINKS = ("box", "cylinder", "frame", "mesh", "sphere")
#: The parent of all entries that name no parent.
_MOUNT = "default_mount"
#: Default attachments, by platform and type. The generator writes all of them.
_ATTACHMENTS: dict[str, dict[str, Any]] = {
    "a200.bumper": {"parent": "front_bumper_mount", "extension": 0.0},
    "a200.sensor_arch": {"model": "sensor_arch_300"},
    "j100.fender": {"parent": "base_link"},
    "j100.top_plate": {"model": "ark_enclosure"},
    **{
        f"{model}.top_plate": {"model": "pacs", "height": 0.1}
        for model in ("dd100", "dd150", "do100", "do150")
    },
    "r100.fams": {"table_height": 0.3},
    "r100.hams": {"table_height": 0.6, "mount_height": 0.3},
    "r100.tower": {"left_height": 0.0, "right_height": 0.0},
}
#: The joint of a gripper that an arm of Kinova needs as a parameter: its suffix after the name of
#: the gripper, by the gripper's model.
_GRIPPER_JOINTS = {
    "kinova_2f_lite": "_right_finger_bottom_joint",
    "robotiq_2f_140": "_finger_joint",
    "robotiq_2f_85": "_robotiq_85_left_knuckle_joint",
}
_NUMBERED = re.compile(r"([a-z]+[0-9]+)-")


def is_clearpath(source: Source) -> bool:
    """Return whether the data is a robot.yaml of Clearpath."""
    data = source.data
    return isinstance(data.get("serial_number"), str) and bool(
        data.keys() & {"platform", "system", "sensors", "mounts"}
    )


def is_autoware(source: Source) -> bool:
    """Return whether the data is a calibration of Autoware.

    Such a file maps parents to child frames, each with x, y, z and angles.
    """
    return bool(source.data) and all(
        isinstance(children, dict)
        and bool(children)
        and all(
            isinstance(child, dict) and {"x", "y", "z"} <= child.keys()
            for child in children.values()
        )
        for children in source.data.values()
    )


def add_autoware(draft: ImportDraft, source: Source) -> None:
    """Add the frames of a calibration file."""
    draft.note(
        ("", ""),
        "calibration: FILE at a frame, instead of xyz and rpy, reads its pose from the calibration"
        " file",
    )
    for parent, children in source.data.items():
        for child, values in children.items():
            path: Steps = (parent, child)
            span = source.key_span(path)
            numbers = [values.get(axis, 0.0) for axis in _AXES]
            if not all(
                isinstance(value, (int, float)) and not isinstance(value, bool)
                for value in numbers
            ):
                draft.todo(f"{child}: its values are not numbers", span)
                continue
            x, y, z, roll, pitch, yaw = map(float, numbers)
            rpy = (roll, pitch, yaw)
            pose = Pose((x, y, z), quat_from_rpy(*rpy))
            draft.frame(str(parent), str(child), pose_keys(pose, rpy), span, where(span))
            left = sorted(values.keys() - set(_AXES))
            if left:
                draft.todo(f"{child}: {', '.join(left)}", span, ("frames", str(child)))


#: Names of calibration files. In a package of individual parameters, they are in
#: config/VEHICLE/KIT.
_CALIBRATIONS = ("sensors_calibration.yaml", "sensor_kit_calibration.yaml")


def add_vehicles(
    draft: ImportDraft,
    folder: Path,
    target: Target,
    selection: Mapping[str, str],
    read: Callable[[str], Source],
) -> None:
    """Add the calibrations from a package of Autoware's individual parameters.

    The package has a folder for each vehicle. The folder of a kit's description contains only the
    calibrations of the kit. If there are several vehicles, the vehicle becomes an argument of the
    robot file. ``selection`` may contain ``vehicle_id`` and ``sensor_model``, as in Autoware's
    launch files.

    Raises:
        RejectedError: if the folder contains no calibrations, or contains several kits and
        ``selection`` names none.
    """
    config = folder / "config" if is_folder(folder / "config") else folder
    folders = sorted(
        (config / name for name in names_in(config) if name.endswith("_calibration.yaml")),
        key=lambda file: (file.name != _CALIBRATIONS[0], file.name),
    )
    if folders:  # the description of a kit, without vehicles
        for file in folders:
            add_kit(draft, read(str(file)))
        return
    kits: dict[str, list[str]] = {}
    for inner in _folders_of_kits(config):
        if any(is_file(inner / name) for name in _CALIBRATIONS):
            kits.setdefault(inner.name, []).append(inner.parent.name)
    kit = _one_of(kits, selection, "sensor_model", str(folder), "kit")
    vehicles = kits[kit]
    usual = "default" if "default" in vehicles else vehicles[0]
    vehicle = _one_of(
        vehicles,
        {"vehicle_id": selection.get("vehicle_id", usual)},
        "vehicle_id",
        str(folder),
        "vehicle",
    )
    of_vehicle = vehicle
    if len(vehicles) > 1:
        of_vehicle = Text.of([Argument("vehicle_id", vehicle)])
        draft.sections["args"]["vehicle_id"] = {
            "type": "string",
            "default": vehicle,
            "choices": vehicles,
        }
    draft.note(("", ""), f"the calibrations of {kit}, which stay in their files")
    for name in _CALIBRATIONS:
        files = {vehicle: config / vehicle / kit / name for vehicle in vehicles}
        sources = {vehicle: read(str(file)) for vehicle, file in files.items() if is_file(file)}
        path = concatenate([target.from_folder(str(config)), of_vehicle, kit, name], "/")
        for (parent, child), having in _calibrated_edges(draft, sources).items():
            keys: dict[str, Any] = {"calibration": path}
            if len(having) < len(vehicles):
                keys["when"] = ExpressionText(
                    " or ".join(f"args.vehicle_id == {_quote(vehicle)}" for vehicle in having)
                )
            draft.frame(parent, child, keys, sources[having[0]].key_span((parent, child)))


def _folders_of_kits(config: Path) -> Iterator[Path]:
    """Yield the kit folders inside the vehicle folders."""
    for vehicle in filter(is_folder, (config / name for name in names_in(config))):
        yield from (vehicle / name for name in names_in(vehicle))


def _quote(text: str) -> str:
    return f'"{text}"' if "'" in text else f"'{text}'"


def _calibrated_edges(
    draft: ImportDraft, sources: Mapping[str, Source]
) -> dict[tuple[str, str], list[str]]:
    """Return the edges in the calibrations, each with the vehicles that have it."""
    edges: dict[tuple[str, str], list[str]] = {}
    for vehicle, source in sources.items():
        if not is_autoware(source):
            draft.todo("no calibration of Autoware's", Span(source.file))
            continue
        for parent, children in source.data.items():
            for child in children:
                edges.setdefault((str(parent), str(child)), []).append(vehicle)
    return edges


def _one_of(
    choices: Collection[str], selection: Mapping[str, str], argument: str, folder: str, what: str
) -> str:
    """Return the selected name, or the only name.

    Raises:
        RejectedError: if there is no name, or if there are several and none is selected.
    """
    choice = selection.get(argument, next(iter(choices)) if len(choices) == 1 else "")
    if choice in choices:
        return choice
    if not choices:
        message = f"no {' or '.join(_CALIBRATIONS)} below config/VEHICLE/KIT"
        raise RejectedError([finding("TF002", message, Span(folder))])
    message = (
        f"there is no {what} {choice}" if choice else f"more than one {what}: {', '.join(choices)}"
    )
    raise RejectedError(
        [finding("TF002", message, Span(folder), help=f"{argument}:={'|'.join(choices)}")]
    )


def _words(value: Any) -> Any:
    """Return the value of a macro's parameter; a list becomes words separated by spaces."""
    return " ".join(map(str, value)) if isinstance(value, list) else value


class _Clearpath:
    """Adds the contents of a robot.yaml to a draft."""

    def __init__(self, draft: ImportDraft, source: Source) -> None:
        self.draft, self.source, self.data = draft, source, source.data
        match = _NUMBERED.match(source.data["serial_number"])
        self.platform = match[1] if match else ""

    def add(self) -> None:
        """Add all sections."""
        self._system()
        self._platform()
        for kind in _LINKS:
            for index, path, entry in self._entries("links", kind):
                name = entry.get("name", f"{kind}_{index}")
                file = f"clearpath_platform_description/urdf/links/{kind}.urdf.xacro"
                self._part(name, file, kind, self._link(name, entry, path), path)
        for kind in self._kinds("mounts"):
            for index, path, entry in self._entries("mounts", kind):
                folder = "urdf/pacs" if kind in _PACS else "urdf"
                file = f"clearpath_mounts_description/{folder}/{kind}.urdf.xacro"
                self._part(f"{kind}_{index}", file, kind, entry, path)
        for kind in self._kinds("sensors"):
            for index, path, entry in self._entries("sensors", kind):
                self._sensor(f"{kind}_{index}", entry, path)
        for kind in self._kinds("manipulators"):
            self._manipulators(kind)
        sections = {
            "serial_number",
            "version",
            "system",
            "platform",
            "links",
            "mounts",
            "sensors",
            "manipulators",
        }
        for key in self.data.keys() - sections:
            self.draft.todo(f"{key} is not imported", self.source.key_span((key,)))

    def _kinds(self, section: str) -> list[str]:
        listed = self.data.get(section)
        return (
            [kind for kind, entries in listed.items() if entries]
            if isinstance(listed, dict)
            else []
        )

    def _entries(self, section: str, kind: str) -> list[tuple[int, Steps, dict[str, Any]]]:
        section_data = self.data.get(section)
        entries = section_data.get(kind) if isinstance(section_data, dict) else None
        listed = entries if isinstance(entries, list) else []
        return [
            (i, (section, kind, i), entry)
            for i, entry in enumerate(listed)
            if isinstance(entry, dict)
        ]

    def _system(self) -> None:
        system = self.data.get("system")
        ros = system.get("ros2") if isinstance(system, dict) else None
        settings = ros if isinstance(ros, dict) else {}
        namespace = str(settings.get("namespace") or "").strip("/")
        if namespace:
            self.draft.sections["ros"] |= {"namespace": namespace, "isolate": "topics"}
            self.draft.note(
                ("ros", "namespace"),
                where(self.source.key_span(("system", "ros2", "namespace"))),
            )
        domain = settings.get("domain_id")
        if isinstance(domain, int):
            self.draft.sections["ros"]["domain_id"] = domain
        for key in settings.keys() - {"namespace", "domain_id"}:
            self.draft.todo(
                f"system.ros2.{key}: {settings[key]}",
                self.source.key_span(("system", "ros2", key)),
            )
        for key in system.keys() - {"ros2"} if isinstance(system, dict) else ():
            self.draft.todo(f"system.{key} is not imported", self.source.key_span(("system", key)))

    def _platform(self) -> None:
        platform = self.data.get("platform")
        settings = platform if isinstance(platform, dict) else {}
        span = self.source.key_span(("serial_number",))
        if not self.platform or self.platform == "generic":
            self.draft.todo(
                f"the platform {self.data['serial_number']}: its description is of its own", span
            )
        else:
            model = self.platform
            wheel = {"wheel": settings.get("wheel", "default")}
            keys = {
                "xacro": self._of_platform(),
                "macro": model,
                "params": wheel,
                "include": [_COMMON],
            }
            self.draft.sections["parts"]["platform"] = keys
            self.draft.note(("parts", "platform"), where(span))
        attachments = settings.get("attachments")
        for index, entry in enumerate(attachments if isinstance(attachments, list) else []):
            path: Steps = ("platform", "attachments", index)
            if not isinstance(entry, dict):
                continue
            of, _, kind = str(entry.get("type", "")).rpartition(".")
            if entry.get("enabled") is False:
                self.draft.todo(
                    f"the attachment {entry.get('name')} is not enabled", self.source.span_of(path)
                )
                continue
            of = of or self.platform
            file = f"clearpath_platform_description/urdf/{of}/attachments/{kind}.urdf.xacro"
            usual = {"model": "default", **_ATTACHMENTS.get(f"{of}.{kind}", {})}
            self._part(
                str(entry.get("name", f"{kind}_{index}")), file, kind, {**usual, **entry}, path
            )
        for key in settings.keys() - {"attachments", "wheel"}:
            self.draft.todo(
                f"platform.{key} is not imported", self.source.key_span(("platform", key))
            )

    def _of_platform(self) -> str:
        file = f"{self.platform}/{self.platform}.urdf.xacro"
        return f"package://clearpath_platform_description/urdf/{file}"

    def _link(self, name: str, entry: dict[str, Any], path: Steps) -> dict[str, Any]:
        """Return the entry of a link with its mesh as an address.

        Note each key that is not a parameter of the link's macro.
        """
        settings = dict(entry)
        mesh = settings.get("visual")
        if isinstance(mesh, dict):
            package, file = mesh.get("package"), str(mesh.get("path", ""))
            settings["visual"] = (
                f"package://{package}/{file.lstrip('/')}" if package else f"file://{file}"
            )
        for key in settings.keys() & {"offset_xyz", "offset_rpy"}:
            self.draft.todo(
                f"{name}: {key}, which Clearpath's macros do not take",
                self.source.key_span((*path, key)),
            )
            del settings[key]
        return settings

    def _part(self, name: str, file: str, macro: str, entry: dict[str, Any], path: Steps) -> None:
        """Add a part for an entry for which the generator calls a macro."""
        span = self.source.span_of(path)
        params: dict[str, Any] = {"name": name, "parent_link": entry.get("parent", _MOUNT)}
        origin = self._origin(entry, path)
        params |= {key: _words(value) for key, value in entry.items() if key not in _OF_CALL}
        params["origin"] = origin
        include = [_COMMON]
        if (
            path[0] in {"sensors", "manipulators"} and self.platform
        ):  # these macros use arguments of the platform's file
            include.append(self._of_platform())
        keys: dict[str, Any] = {
            "xacro": f"package://{file}",
            "macro": macro,
            "params": params,
            "include": include,
        }
        self.draft.sections["parts"][name] = keys
        self.draft.note(("parts", name), where(span))

    def _origin(self, entry: dict[str, Any], path: Steps) -> dict[str, Any]:
        vectors: dict[str, Vector] = {}
        for key in ("xyz", "rpy"):
            value = entry.get(key, [0.0, 0.0, 0.0])
            is_one = isinstance(value, list) and len(value) == len(_AXES) // 2
            if not is_one or not all(isinstance(number, (int, float)) for number in value):
                self.draft.todo(f"{key}: {value}", self.source.span_of((*path, key)))
                value = [0.0, 0.0, 0.0]
            x, y, z = map(float, value)
            vectors[key] = (x, y, z)
        return pose_keys(Pose(vectors["xyz"], quat_from_rpy(*vectors["rpy"])), vectors["rpy"]) or {
            "xyz": [0, 0, 0]
        }

    def _sensor(self, name: str, entry: dict[str, Any], path: Steps) -> None:
        span, model = self.source.span_of(path), str(entry.get("model", ""))
        if entry.get("urdf_enabled") is False:
            self.draft.todo(f"{name}, {model}: urdf_enabled is false", span)
            return
        call = {key: value for key, value in entry.items() if key in _OF_CALL} | self._camera(
            model, entry
        )
        self._part(
            name, f"clearpath_sensors_description/urdf/{model}.urdf.xacro", model, call, path
        )
        parameters = entry.get("ros_parameters")
        if entry.get("launch_enabled") is not False:
            nodes = (
                f" ({', '.join(parameters)})"
                if isinstance(parameters, dict) and parameters
                else ""
            )
            message = f"the driver of {name}, {model}, with its ros_parameters{nodes}"
            advice = (
                "sensors: {NAME: {preset: VENDOR/MODEL, …}} starts it; tfcompose presets lists"
                " them"
            )
            self.draft.todo(message, span, ("parts", name), advice)

    def _camera(self, model: str, entry: dict[str, Any]) -> dict[str, Any]:
        """Return the parameter that selects a camera model, if the frames depend on the model."""
        if model != "stereolabs_zed":
            return {}
        node = (entry.get("ros_parameters") or {}).get(model)
        camera_model = (
            node.get("general.camera_model") or (node.get("general") or {}).get("camera_model")
            if node
            else None
        )
        return {"model": camera_model or "zed2"}

    def _arm(self, name: str, model: str, entry: dict[str, Any]) -> dict[str, Any]:
        """Return the parameters of an arm's macro."""
        settings = {
            key: value
            for key, value in entry.items()
            if key not in {"model", "ros_parameters", "gripper", "ip"}
        }
        if "ip" in entry:
            settings["robot_ip" if model.startswith("kinova") else "ip"] = entry["ip"]
        gripper = entry.get("gripper")
        joint = (
            _GRIPPER_JOINTS.get(str(gripper.get("model", "")))
            if isinstance(gripper, dict)
            else None
        )
        if joint and model.startswith("kinova"):
            settings |= {
                "use_internal_bus_gripper_comm": True,
                "gripper_joint_name": f"{name}_gripper{joint}",
            }
        return settings

    def _manipulators(self, kind: str) -> None:
        for index, path, entry in self._entries("manipulators", kind):
            model, type_ = str(entry.get("model", "")), kind.removesuffix("s")
            name = f"{type_}_{index}"
            settings = self._arm(name, model, entry)
            self._part(
                name,
                f"clearpath_manipulators_description/urdf/{type_}/{model}.urdf.xacro",
                model,
                settings,
                path,
            )
            gripper = entry.get("gripper")
            if isinstance(gripper, dict):
                grip = str(gripper.get("model", ""))
                file = f"clearpath_manipulators_description/urdf/gripper/{grip}.urdf.xacro"
                held = {"parent": f"{name}_end_effector_link", **gripper}
                held.pop("model", None)
                self._part(f"{name}_gripper", file, grip, held, (*path, "gripper"))
            for key in entry.keys() & {"ros_parameters"}:
                self.draft.todo(
                    f"{name}: {key}", self.source.key_span((*path, key)), ("parts", name)
                )


def add_clearpath(draft: ImportDraft, source: Source) -> None:
    """Add the robot of a Clearpath robot.yaml."""
    draft.has_unknown_frames = True
    _Clearpath(draft, source).add()


def add_kit(draft: ImportDraft, source: Source) -> None:
    """Add a YAML file of Clearpath or Autoware.

    Raises:
        RejectedError: if the file is neither.
    """
    if is_clearpath(source):
        add_clearpath(draft, source)
    elif is_autoware(source):
        add_autoware(draft, source)
    else:
        advice = (
            "a launch file has launch:, Clearpath's robot.yaml serial_number:, Autoware's PARENT:"
            " {CHILD: {x, …}}"
        )
        message = "neither a launch file, nor Clearpath's robot.yaml, nor Autoware's calibration"
        raise RejectedError([finding("TF002", message, Span(source.file), help=advice)])
