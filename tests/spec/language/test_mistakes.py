"""What people write by mistake or by habit.

Each is found at its place, with help that names what to write.
"""

from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in
from tfcompose.spec.language.habits import habit
from tfcompose.spec.language.values import COLOURS

BASE = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
CAM = BASE + "sensors:\n  cam: {preset: realsense/d435i, parent: base_link, %s}\n"
ARG = "tfcompose: 1\nrobot: r\nargs: {on: false}\nframes:\n  base_link: {}\n"
MAST = "  mast: {parent: base_link, when: '${args.on}'}\n"
FRAME = BASE + "frames:\n  mast: {parent: base_link, %s}\n"
PROCESS = BASE + "processes:\n  a: {run: [sleep, '9']}\n  b: {run: [sleep, '9'], %s}\n"
SHAPE = "tfcompose: 1\nrobot: r\nlinks: {base_link: {visual: {box: [1, 1, 1], %s}}}\n"

#: (text, where and what is found, words of its help)
MISTAKES = [
    # keys of URDF, launch files, messages and compose files
    (FRAME % "pose: [0, 0, 1, 0, 0, 0]", "5:29 TF101", "xyz rpy"),
    (FRAME % "origin: {xyz: [0, 0, 1]}", "5:29 TF101", "xyz rpy"),
    (FRAME % "translation: [0, 0, 1]", "5:29 TF101", "xyz"),
    (FRAME % "position: [0, 0, 1]", "5:29 TF101", "xyz"),
    (FRAME % "rotation: [0, 0, 1]", "5:29 TF101", "rpy quat_xyzw"),
    (FRAME % "quaternion: [0, 0, 0, 1]", "5:29 TF101", "quat_xyzw"),
    (FRAME % "frame_id: x", "5:29 TF101", "parent"),
    (FRAME % "publisher: x", "5:29 TF101", "owner"),
    (CAM % "position: [0, 0, 1]", "5:53 TF101", "xyz"),
    (CAM % "imu: true", "5:53 TF101", "options: imu:"),
    (CAM % "driver: off", "5:61 TF813", "none"),
    (CAM.replace("realsense/", "") % "rate: 5", "5:17 TF601", "realsense/d435i"),
    (PROCESS % "depends_on: [a]", "6:26 TF101", "after:"),
    (PROCESS % "environment: [A=1]", "6:26 TF101", "env:"),
    (PROCESS % "respawn: true", "6:26 TF101", "restart"),
    (PROCESS % "after: [a]", "6:33 TF103", "after: {a: ready}"),
    (PROCESS % "after: a", "6:33 TF103", "after: {a: ready}"),
    (PROCESS % "env: [A=1]", "6:31 TF103", "env: {A: '1'}"),
    (PROCESS % "remap: ['/a:=/b']", "6:33 TF103", "remap: {/a: /b}"),
    (PROCESS % "remap: [[a, b]]", "6:33 TF103", "remap: {a: b}"),
    (PROCESS % "params: nav2.yaml", "6:34 TF103", "params: {file: nav2.yaml}"),
    (PROCESS % "cmd: [a]", "6:26 TF101", "run:"),
    (PROCESS % "owns: [odom]", "6:26 TF101", "owner:"),
    (PROCESS % "simulate: fixed", "6:36 TF103", "{fixed:"),
    (BASE + "guard: strict\n", "4:8 TF103", "{mode: strict}"),
    (BASE + "rules: {TF999: off}\n", "4:9 TF017", "a code that lint prints"),
    (CAM % "params: {a: 1}", "5:53 TF101", "driver: params:"),
    (
        BASE + "parts:\n  arm: {file: arm.yaml, parent: base_link}\n",
        "5:9 TF101",
        "spec: arm.yaml urdf: xacro:",
    ),
    (
        SHAPE.replace("{box: [1, 1, 1], %s}", "{cylinder: {radius: 1, width: 1}}"),
        "3:52 TF101",
        "length",
    ),
    (BASE + "processes:\n  a: {external: yes}\n", "5:17 TF106", "true"),
    (CAM % "driver: {serial: 1}", "5:62 TF101", "options: {serial:"),
    (CAM % "serial: 1", "5:53 TF101", "options: {serial:"),
    (CAM % "mount: base_link", "5:53 TF101", "parent"),
    (CAM % "place: nopes", "5:60 TF203", "cam_link"),
    (BASE + "frames:\n  - mast: {}\n", "5:3 TF103", "frames: {mast: {…}}"),
    (BASE + "frames:\n  - name: mast\n", "5:3 TF103", "frames: {mast: {…}}"),
    (FRAME % "quat_wxyz: [1, 0, 0, 0]", "5:29 TF101", "quat_xyzw: w last"),
    (FRAME % "rpy_deg: [0, 90, 0]", "5:29 TF101", "90 deg"),
    (SHAPE.replace("visual: {box: [1, 1, 1], %s}", "box: [1, 1, 1]"), "3:21 TF101", "visual:"),
    (
        SHAPE.replace("visual: {box: [1, 1, 1], %s}", "inertial: {mass: 1, ixx: 1}"),
        "3:41 TF101",
        "inertia:",
    ),
    (PROCESS % "package: nav2_amcl", "6:26 TF101", "run: nav2_amcl"),
    (PROCESS % "executable: amcl", "6:26 TF101", "run: amcl"),
    (PROCESS % "preset: ekf", "6:26 TF101", "node: {preset: ekf}"),
    (PROCESS % "args: [--fast]", "6:26 TF101", "run: args:"),
    (PROCESS % "ros2_control: base_controller", "6:26 TF101", "controller_manager"),
    (PROCESS % "remap: {/cmd_vel: '/cmd vel'}", "6:44 TF106", ""),
    (PROCESS % "remap: {'scan:=front': scan}", "6:34 TF106", ""),
    (
        BASE
        + "processes:\n  nav: {run: {package: nav2_bringup, executable: navigation_launch.py}}\n",
        "5:50 TF106",
        "launch: nav2_bringup/navigation_launch.py",
    ),
    (
        BASE + "processes:\n  joints: {simulate: {joints: sweep}}\n",
        "5:12 TF101",
        "name of its own",
    ),
    (BASE + "namespace: nurse\n", "4:1 TF101", "ros: {namespace: nurse}"),
    (BASE + "use_sim_time: true\n", "4:1 TF101", "ros: {clock: sim}"),
    (BASE + "units: {length: cm}\n", "4:1 TF101", "30 cm"),
    (CAM % "look: front", "5:59 TF106", "forward"),
    (CAM % "inverted: true", "5:53 TF101", "rpy: 180 deg"),
    (FRAME % "tf: driver", "5:29 TF101", "sensors owner"),
    (SHAPE.replace("[1, 1, 1], %s", "{size: [0.2, 0.3, 1]}"), "3:35 TF103", "[0.2, 0.3, 1]"),
    (SHAPE.replace("[1, 1, 1], %s", "{size: 0.2 0.3 1}"), "3:35 TF103", "[0.2, 0.3, 1]"),
    (
        SHAPE.replace("box: [1, 1, 1], %s", "cylinder: {radius: 1, height: 1}"),
        "3:52 TF101",
        "length",
    ),
    (SHAPE.replace("box: [1, 1, 1], %s", "sphere: {diameter: 1}"), "3:39 TF101", "radius"),
    (
        BASE.replace("{}}", "{}, lift: {}}")
        + "joints:\n  j: {type: hinge, parent: base_link, child: lift, mimic: k}\n",
        "5:13 TF106",
        "revolute",
    ),
    (
        BASE.replace("{}}", "{}, lift: {}}")
        + "joints:\n  j: {type: continuous, parent: base_link, child: lift, mimic: k}\n",
        "5:64 TF103",
        "{joint: k}",
    ),
    (
        BASE + "joints:\n  i: {type: continuous, parent: base_link, child: pan}\n"
        "frames: {eye: {parent: pan}}\n",
        "6:24 TF203",
        "links: {pan: {}}",
    ),
    (BASE + "env: {A: b}\n", "4:1 TF101", "env: domain_id:"),
    (BASE + "ros: {use_sim_time: true}\n", "4:7 TF101", "clock: sim"),
    (PROCESS % "after: {a: running}", "6:37 TF106", "started"),
    (
        BASE + "frames:\n  base_link: {parent: base_footprint}\n",
        "5:23 TF203",
        "frames: {base_footprint: {}}",
    ),
    (FRAME % "owner: static_transform_publisher", "5:36 TF302", "leave owner out"),
    # owners
    (BASE + "frames:\n  odom: {owner: drive}\n", "5:10 TF102", "owner: drive child"),
    (
        BASE
        + "frames:\n  mast: {parent: base_link, owner: node}\nprocesses:\n  a: {external: true, node: node}\n",  # noqa: E501 (a text as its reader has it)
        "5:36 TF302",
        "did you mean a",
    ),
    (
        BASE.replace("{}}", "{}, lift: {}}")
        + "joints:\n  j: {type: continuous, parent: base_link, child: lift, mimic: {joint: k}}\n",
        "5:72 TF701",
        "",
    ),
    (PROCESS % "ready: {topic: '/sc an'}", "6:41 TF106", ""),
    # conditions
    (ARG + MAST + "  tip: {parent: mast}\n", "7:17 TF203", "when: ${args.on};"),
    (
        ARG + MAST + "  tip: {parent: base_link, relative_to: mast}\n",
        "7:41 TF203",
        "when: ${args.on};",
    ),
    (
        ARG
        + "  tip: {parent: base_link, owner: drive}\nprocesses: {drive: {when: '${args.on}', external: true}}\n",  # noqa: E501 (a text as its reader has it)
        "6:35 TF302",
        "when: ${args.on};",
    ),
    # what is new to YAML
    (BASE + "frames:\n  laser\n    parent: base_link\n", "5:3 TF002", "laser:"),
    (BASE + "frames:\n\n  laser  # on top\n    parent: base_link\n", "6:3 TF002", "laser:"),
    (BASE + "frames:\n  laser: {parent:base_link}\n", "5:11 TF006", "parent: base_link"),
    (BASE + "frames:\n  tag36h11:7:\n", "5:3 TF006", "{}"),
    (BASE + "frames:\n  sensors:\n    cam: {preset: x}\n", "5:3 TF101", "indent"),
    (BASE + "frames:\nmast: {parent: base_link}\n", "5:1 TF101", "indent frames"),
    (BASE + "frames:\n  mast:\n  parent: base_link\n", "6:11 TF103", "indent"),
    (BASE + "frames:\n\u00a0 mast: {}\n", "5:1 TF002", "space"),
    # colours
    (SHAPE % "material: {color: [0, 0, 1]}", "3:57 TF101", "rgba"),
    (SHAPE % "color: bleu", "3:53 TF106", "blue"),
    (SHAPE % "color: [0, 0, 1], material: red", "3:64 TF107", ""),
    # numbers
    (FRAME % "xyz: [0,2, 0, 0,1]", "5:34 TF103", "point"),
    (FRAME % "xyz: [0, 0, 1,5 m]", "5:34 TF103", "point"),
    (FRAME % "xyz: ['0,2', 0, 0]", "5:35 TF103", "0.2"),
    (FRAME % "xyz: 0.2 0 0.1", "5:34 TF103", "[0.2, 0, 0.1]"),
    (FRAME % "xyz: {x: 0.2, z: 0.1}", "5:34 TF103", "[0.2, 0, 0.1]"),
    (FRAME % "xyz: [30 cmm, 0, 0]", "5:35 TF104", "cm mm"),
    (FRAME % "rate: 1,5 Hz", "5:37 TF006", "point"),
    (FRAME % "xyz: [20 cm 0 10 cm]", "5:34 TF103", "[20 cm, 0, 10 cm]"),
    (
        FRAME % "xyz: [0.2, 0, 0.1, 0, 0, 1.57]",
        "5:34 TF103",
        "xyz: [0.2, 0, 0.1] rpy: [0, 0, 1.57]",
    ),
    (FRAME % "rpy: {yaw: 90 deg}", "5:34 TF103", "[0, 0, 90 deg]"),
    (FRAME % "xyz: [0, 0, $mast]", "5:41 TF103", '"${mast}"'),
    (FRAME % "xyz: [0, 0, mast]", "5:41 TF103", '"${mast}"'),
    (FRAME % "rpy: [0, 0, pi/2]", "5:41 TF103", '"${pi/2}"'),
    (FRAME % "xyz: [0, 0, '$(var mast)']", "5:41 TF103", '"${mast}"'),
    (FRAME % "rpy: [0, 0, '${math.pi/2}']", "5:41 TF105", "pi"),
    # YAML
    (BASE + "frames:\n  mast: {parent: base_link}\n  cam {parent: mast}\n", "6:3 TF002", "cam:"),
    (BASE + "frames:\n  mast:{parent: base_link}\n", "5:3 TF002", "mast:"),
    (BASE + "frames\n  mast: {parent: base_link}\n", "4:1 TF002", "frames:"),
    (
        BASE + "frames:\n  mast: {parent: base_link}\n   cam: {parent: mast}\n",
        "6:4 TF002",
        "column 3",
    ),
    (BASE + "  frames:\n    mast: {parent: base_link}\n", "4:3 TF002", "column 1"),
    (FRAME % "xyz: [0, 0, ${mast}]", "5:42 TF002", '"${mast}"'),
    (FRAME % "xyz: {${mast}}", "5:36 TF002", '"${mast}"'),
    (
        BASE + "frames:\n  mast:\n    parent base_link\n    xyz: [0, 0, 1]\n",
        "6:5 TF002",
        "parent: base_link",
    ),
    (
        BASE + "frames:\n  mast:\n    parent:base_link\n    xyz: [0, 0, 1]\n",
        "6:5 TF002",
        "parent: base_link",
    ),
    (
        BASE + "frames:\n  mast:\n    parent: base_link\n      xyz: [0, 0, 1]\n",
        "7:7 TF002",
        "column 5",
    ),
    ("tfcompose:1\nrobot: r\n", "1:1 TF002", "tfcompose: 1"),
    ("tfcompose: 1\nrobot r\nlinks: {}\n", "2:1 TF002", "robot: r"),
    (BASE + "frames: mast: {parent: base_link}\n", "4:9 TF002", "next line"),
    (BASE + "frames: {mast: {parent: base_link}} // mast\n", "4:37 TF002", "# mast"),
    (BASE + "frames: {mast: {xyz: [0, 0, 1}}\n", "4:30 TF002", "]"),
    (BASE + "frames: {mast: {parent: 'base_link}}\n", "4:25 TF002", "'"),
    # names in profiles
    (
        CAM % "rate: 5" + "profiles:\n  demo:\n    sensors: {camm: {driver: none}}\n",
        "8:15 TF102",
        "cam?",
    ),
]


@pytest.mark.parametrize("case", MISTAKES, ids=lambda case: case[1] + " " + case[2][:20])
def test_a_mistake_is_found_at_its_place_with_help_that_names_what_to_write(
    case: tuple[str, str, str], tmp_path: Path
) -> None:
    text, place, words = case
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    printed = tfcompose_in(tmp_path, "lint").stdout
    where, code = place.split()
    _, begin, rest = printed.partition(f"robot.yaml:{where}: error[{code}]")
    assert begin, printed
    advice = rest.partition("help: ")[2].partition("\n")[0]
    assert all(word in advice for word in words.split()), printed


@pytest.mark.parametrize(
    "words",
    [
        "color: blue",
        "color: [0, 0, 1]",
        "color: [0, 0, 1, 1]",
        "material: blue",
        "material: {rgba: blue}",
    ],
)
def test_a_colour_is_three_parts_four_or_a_name(words: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(SHAPE % words, "utf-8")
    built = tfcompose_in(tmp_path, "build", "-o", "out")
    assert built.returncode == 0, built.stderr
    assert 'rgba="0 0 1 1"' in (tmp_path / "out" / "robot.urdf").read_text("utf-8")


def test_a_material_that_is_defined_wins_over_the_colour_of_its_name(tmp_path: Path) -> None:
    text = (
        "tfcompose: 1\nrobot: r\nlinks:\n  base_link: {visual: {box: [1, 1, 1], material: blue}}\n"
    )
    text += (
        "  arm: {parent: base_link, visual: {box: [1, 1, 1], material: {name: blue, rgba: [0, 0.1,"
        " 0.2]}}}\n"
    )
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    assert tfcompose_in(tmp_path, "build", "-o", "out").returncode == 0
    urdf = (tmp_path / "out" / "robot.urdf").read_text("utf-8")
    assert urdf.count('rgba="0 0.1 0.2 1"') >= 1
    assert 'rgba="0 0 1 1"' not in urdf


def test_no_habit_names_a_key_that_is_not_there() -> None:
    assert habit("position", {"xyz"})
    assert not habit("position", {"rate"})
    assert not habit("xyz", {"xyz"})
    assert all(len(parts) == 3 for parts in COLOURS.values())


def test_a_second_sensor_of_a_profile_is_not_taken_for_a_slip(tmp_path: Path) -> None:
    profile = "profiles: {demo: {frames: {mast2: {parent: base_link}}}}\n"
    (tmp_path / "robot.yaml").write_text(FRAME % "xyz: [0, 0, 1]" + profile, "utf-8")
    assert tfcompose_in(tmp_path, "lint").returncode == 0


def test_where_a_limit_is_refused_the_default_one_judges_nothing(tmp_path: Path) -> None:
    sensor = "sensors: {cam: {preset: realsense/d435i, parent: base_link, xyz: [0.1, 0, 0]}}\n"
    for rules, code in (
        ("", "TF640"),
        ("rules: {TF640: {limit: 5 kg}}\n", "TF104"),
        ("rules: {TF640: no}\n", "TF106"),
    ):
        (tmp_path / "robot.yaml").write_text(SHAPE % "color: red" + sensor + rules, "utf-8")
        printed = tfcompose_in(tmp_path, "lint").stdout
        assert {
            one.partition("]")[0] for one in printed.split("[")[1:] if one.startswith("TF")
        } == {code}, printed


def test_an_unknown_place_is_found_with_a_part_that_cannot_be_read(tmp_path: Path) -> None:
    part = "parts: {arm: {xacro: gone.xacro, parent: base_link}}\n"
    (tmp_path / "robot.yaml").write_text(CAM % "place: nopes" + part, "utf-8")
    printed = tfcompose_in(tmp_path, "lint").stdout
    assert "robot.yaml:5:60: error[TF203]" in printed
    assert "gone.xacro:1:1: error[TF001]" in printed


def test_an_entry_that_a_profile_misspells_is_one_finding_that_names_it(tmp_path: Path) -> None:
    profile = "profiles: {demo: {sensors: {cmm: {driver: none}}}}\n"
    (tmp_path / "robot.yaml").write_text(CAM % "tf: tfcompose" + profile, "utf-8")
    printed = tfcompose_in(tmp_path, "lint").stdout
    assert printed.count("error[") == 1
    assert "did you mean cam?" in printed


def test_a_process_that_was_refused_is_no_unknown_owner(tmp_path: Path) -> None:
    for way in ("external: yes", "run: {package: a}", "cmd: [a]"):
        text = (
            BASE
            + f"frames: {{mast: {{parent: base_link, owner: a}}}}\nprocesses:\n  a: {{{way}}}\n"
        )
        (tmp_path / "robot.yaml").write_text(text, "utf-8")
        printed = tfcompose_in(tmp_path, "lint").stdout
        assert printed.count("error[") == 1, printed
        assert "TF302" not in printed


def test_the_numbers_of_a_part_are_judged_with_the_robot_that_holds_it(tmp_path: Path) -> None:
    limit = "limit: {lower: -170, upper: 3, velocity: 1, effort: 1}"
    joint = (
        f"joints: {{j: {{type: revolute, parent: base, child: tip, axis: [0, 0, 1], {limit}}}}}\n"
    )
    arm = (
        "tfcompose: 1\nrobot: arm\nlinks: {base: {}, tip: {}}\n"
        + joint
        + "frames: {far: {parent: tip, xyz: [0, 250, 0]}}\n"
    )
    parts = "parts:\n  left: {spec: arm.yaml, prefix: left_, parent: base_link}\n"
    (tmp_path / "arm.yaml").write_text(arm, "utf-8")
    (tmp_path / "robot.yaml").write_text(BASE + parts, "utf-8")
    printed = tfcompose_in(tmp_path, "lint", "robot.yaml").stdout
    assert "arm.yaml:4:88: warning[TF410]" in printed
    assert "arm.yaml:5:38: warning[TF414]" in printed
