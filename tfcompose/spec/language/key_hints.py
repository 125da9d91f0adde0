"""Keys of other formats, with the keys to write instead.

The formats are URDF, launch files, ROS messages and compose files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.model.process_keys import PROCESS_KEYS

if TYPE_CHECKING:
    from collections.abc import Collection

_POSITION = "the position is xyz: [0.2, 0, 30 cm]"
_ROTATION = "the rotation is rpy: [0, 0, 90 deg], or quat_xyzw: [0, 0, 0, 1], or look"
_POSE = "the pose is xyz: [0.2, 0, 30 cm] and rpy: [0, 0, 90 deg]"
_PARENT = "the frame that it is mounted on is parent"
_OWNER = "the process that publishes the edge is owner"
_TOPIC = "topics are set in the driver: driver: {remap: {scan: front/scan}}, or params"
_OPTION = "it is an option of the sensor: options: {WORD: …}; tfcompose presets PRESET lists them"
_ROBOTS = "several robots are parts: {r1: {spec: rover.yaml, namespace: r1, prefix: r1_}}"
_MASS = "it belongs under inertial: {mass: 2 kg}"

#: By word: the key with this meaning, and advice.
_OF_THE_LANGUAGE: dict[str, tuple[tuple[str, str], ...]] = {
    habit_word: meanings
    for habit_words, meanings in (
        ("robots fleet", (("parts", _ROBOTS),)),
        ("pose origin transform", (("xyz", _POSE),)),
        (
            "tf",
            (
                (
                    "xyz",
                    "tf is for sensors; the process that publishes the edge is owner, and "
                    + _POSE,
                ),
            ),
        ),
        (
            "inverted upside_down flipped",
            (("rpy", "hanging upside down is rpy: [180 deg, 0, 0]"),),
        ),
        ("position translation trans location offset x y z", (("xyz", _POSITION),)),
        ("rotation orientation rot euler roll pitch yaw", (("rpy", _ROTATION),)),
        (
            "quaternion quat q qx qy qz qw",
            (("quat_xyzw", "a quaternion is quat_xyzw: [0, 0, 0, 1], w last"),),
        ),
        (
            "quat_wxyz quaternion_wxyz wxyz",
            (
                (
                    "quat_xyzw",
                    (
                        "a quaternion is quat_xyzw: [0, 0, 0, 1]: move w from the first place to"
                        " the last"
                    ),
                ),
            ),
        ),
        (
            "rpy_deg rpy_degrees euler_deg",
            (("rpy", "degrees are rpy: [0, 0, 90 deg], each value with its unit"),),
        ),
        (
            "parent_frame parent_link parent_frame_id base frame header mount mounted_on",
            (("parent", _PARENT),),
        ),
        (
            "frame_id child_frame child_frame_id",
            (
                (
                    "parent",
                    (
                        "the key before the colon names the frame; parent is the frame that it is"
                        " mounted on"
                    ),
                ),
            ),
        ),
        ("publisher broadcaster published_by publish", (("owner", _OWNER),)),
        ("frequency hz fps", (("rate", "how often is rate: 50 Hz"),)),
        (
            "color colour rgb rgba",
            (
                ("color", "a colour is color: [0.2, 0.4, 0.8], or color: blue"),
                ("rgba", "a colour is rgba: [0.2, 0.4, 0.8, 1], or rgba: blue"),
                (
                    "visual",
                    "a colour belongs to a shape: visual: {box: [0.5, 0.4, 0.15], color: blue}",
                ),
            ),
        ),
        ("geometry", (("box", "write the shape without it: box: [0.5, 0.4, 0.15]"),)),
        (
            "box cylinder sphere mesh shape",
            (("visual", "a shape belongs under visual: {box: [0.5, 0.4, 0.15]}"),),
        ),
        ("scale", (("mesh", "it belongs to the file: mesh: {uri: base.stl, scale: 0.001}"),)),
        ("mass inertia density", (("inertial", _MASS),)),
        (
            "ixx iyy izz ixy ixz iyz",
            (("inertia", "it belongs under inertia: {ixx: 0.1, iyy: 0.1, izz: 0.1}"),),
        ),
        (
            "filename file",
            (
                ("uri", "the file is uri"),
                ("mesh", "a file is mesh: meshes/base.stl"),
                (
                    "spec",
                    (
                        "another robot file is spec: VALUE; URDF is urdf: FILE, and xacro is"
                        " xacro: FILE"
                    ),
                ),
            ),
        ),
        (
            "depends_on requires wait_for needs",
            (("after", "what it waits for is after: {NAME: ready}"),),
        ),
        ("if condition unless", (("when", "whether it is there is when: ${args.sim}"),)),
        (
            "env environment",
            (
                (
                    "processes",
                    (
                        "variables are a process's: processes: {NAME: {env: {…}}}; the domain is"
                        " ros: {domain_id: 5}"
                    ),
                ),
            ),
        ),
        ("remappings remaps", (("remap", "other names are remap: {scan: front/scan}"),)),
        (
            "parameters ros__parameters params",
            (
                ("params", "parameters are params: {use_sim_time: false}"),
                (
                    "driver",
                    "parameters are those of its driver: driver: {params: {use_sim_time: false}}",
                ),
            ),
        ),
        (
            "owns",
            (
                (
                    "run",
                    (
                        "an edge names its owner: frames: {base_link: {parent: odom, owner:"
                        " base_drive}}"
                    ),
                ),
            ),
        ),
        ("command cmd exec entrypoint", (("run", "the command is run: [program, argument]"),)),
        (
            "topic topics",
            (("remap", "other names are remap: {scan: front/scan}"), ("driver", _TOPIC)),
        ),
        (
            "name",
            (
                (
                    "frames",
                    (
                        "the key before the colon is the name; frames: {camera_link: {name: lens}}"
                        " renames a frame"
                    ),
                ),
            ),
        ),
        (
            "serial serial_number serial_no ip port device hostname",
            (("process", _OPTION), ("options", _OPTION)),
        ),
        ("package pkg", (("run", "a ROS node is run: {package: VALUE, executable: …}"),)),
        ("executable", (("run", "a ROS node is run: {package: …, executable: VALUE}"),)),
        ("launch launch_file", (("run", "a launch file is run: {launch: VALUE}"),)),
        (
            "args arguments launch_arguments",
            (
                (
                    "run",
                    (
                        "they belong to what is run: {launch: …, args: {use_sim_time: false}}, or"
                        " args: [--verbose]"
                    ),
                ),
            ),
        ),
        (
            "ros2_control controller controllers",
            (
                (
                    "run",
                    (
                        "controllers are nodes of run: {package: controller_manager, executable:"
                        " ros2_control_node}"
                    ),
                ),
            ),
        ),
        (
            "preset",
            (("node", "the preset of a node is node: {preset: VALUE}; it knows what to start"),),
        ),
        (
            "namespace domain_id rmw frame_prefix clock discovery distro",
            (("ros", "it belongs under ros: {WORD: VALUE}"),),
        ),
        (
            "use_sim_time sim_time",
            (
                ("ros", "simulated time is ros: {clock: sim}"),
                ("clock", "simulated time is clock: sim"),
            ),
        ),
        ("min minimum", (("lower", "the least is lower"),)),
        ("max maximum", (("upper", "the most is upper"),)),
        (
            "units unit",
            (
                (
                    "vars",
                    "each value has its unit: 30 cm, 15 deg; bare numbers are metres and radians",
                ),
            ),
        ),
        ("height width", (("length", "the WORD of a cylinder is length"),)),
        ("diameter", (("radius", "half of the diameter is radius"),)),
        (
            "type model",
            (("preset", "the model is preset: realsense/d435i; tfcompose presets lists them"),),
        ),
    )
    for habit_word in habit_words.split()
}
#: The same for keys of a process, by the word in the other format.
_OF_PROCESSES: dict[str, tuple[tuple[str, str], ...]] = {
    habit_word: ((row.name, advice),)
    for row in PROCESS_KEYS
    for habit_words, advice in row.habits
    for habit_word in habit_words.split()
}
_HABITS = {
    habit_word: _OF_PROCESSES.get(habit_word, ()) + _OF_THE_LANGUAGE.get(habit_word, ())
    for habit_word in _OF_THE_LANGUAGE.keys() | _OF_PROCESSES.keys()
}


#: Values of other formats, with their names in this language.
_VALUES = {
    habit_word: value
    for habit_words, value in (
        ("front forwards ahead", "forward"),
        ("back rear backwards behind", "backward"),
        ("upward upwards top", "up"),
        ("downward downwards bottom", "down"),
        ("hinge rotary rotational", "revolute"),
        ("slider linear sliding", "prismatic"),
        ("wheel", "continuous"),
        ("unless-stopped", "always"),
        ("running launched", "started"),
        ("healthy live active", "ready"),
        ("finished exited completed", "done"),
        ("on_failure", "on-failure"),
    )
    for habit_word in habit_words.split()
}


def habit(name: str, keys: Collection[str], value: object = None) -> str:
    """Return what to write instead of another format's key, given the valid ``keys``.

    ``value`` is the value of the key.
    """
    advice = next((advice for key, advice in _HABITS.get(name, ()) if key in keys), "")
    return advice.replace("WORD", name).replace("VALUE", value if isinstance(value, str) else "…")


def usual_value(text: str, allowed: Collection[str]) -> str:
    """Return the allowed word with the same meaning, otherwise the word itself."""
    value = _VALUES.get(text.lower(), text)
    return value if value in allowed else text
