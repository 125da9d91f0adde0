"""A small robot for tests that start one: a fixed edge, and one that a stand-in publishes."""

ROVER = """
tfcompose: 1
robot: rover
ros: {discovery: localhost}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
processes:
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
"""
#: The same with a drive that somebody else starts.
EXTERNAL = ROVER.replace(
    "{simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}", "{external: true, node: diff_drive}"
)
#: A robot whose arm's driver runs on another host.
ON_TWO_HOSTS = """
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  arm: {parent: base_link, owner: arm_drive, rate: 20 Hz}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
processes:
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
  arm_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: jetson, after: {drive: ready}}
"""  # noqa: E501 (a text as its reader has it)
#: A robot with names in every place where a xacro macro prefixes them, and texts that xacro would
#: evaluate.
EVERYTHING = """tfcompose: 1
robot: class
links:
  base_link:
    visual: {mesh: meshes/a.stl, material: {name: paint, rgba: [1, 0, 0, 1]}}
    inertial: {mass: 1, inertia: {ixx: 1, iyy: 1, izz: 1}}
  link: {visual: {mesh: "package://x/$(y)/$$(z).stl"}}
  hand: {}
joints:
  joint: {type: continuous, parent: base_link, child: link}
  hand_joint: {type: continuous, parent: link, child: hand, mimic: {joint: joint, multiplier: 2}}
frames: {tool: {parent: hand, xyz: [0, 0, 1]}}
ros2_control:
  motors:
    {plugin: x/Y, params: {path: "$HOME/$(cwd)", tip: hand}, joints:
      {joint: {command: {effort: {min: joint}}, params: {mimic: joint}}}, gpios: {lamp: {state: [on]}}}
xml:
  all: |
    <!-- $(find here) stays -->
    <gazebo reference="hand"><plugin name="p" filename='q'><frame> base_link </frame><joint>joint</joint>
      <text>base_link of joint $(eval 1)</text><cost>$5 $$(x)</cost></plugin></gazebo>
    <transmission name="drive"><joint name="joint"/><actuator name="motor"/></transmission>
"""  # noqa: E501 (a text as its reader has it)
#: A robot with everything that a process can have.
DRIVEN = """
tfcompose: 1
robot: rover
ros: {discovery: localhost, namespace: r1, domain_id: 7}
frames:
  map: {}
  dock: {parent: map, xyz: [1, -2, 0.5], rpy: [0, 0, 30 deg]}
  odom: {parent: map, owner: slam, rate: 10 Hz}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
links:
  lidar: {parent: base_link, xyz: [0, 0, 0.3], visual: {box: [0.1, 0.1, 0.1]}}
processes:
  drive:
    run: {package: base, executable: drive_node, args: [--fast]}
    node: drive
    params: {wheel: 0.1}
    remap: {cmd: cmd_vel}
    env: {GREETING: "100 % \\"sure\\" $HOME"}
    restart: always
    lifecycle: active
    stop: {signal: SIGTERM, timeout: 2 s}
  slam: {run: [slam, --now], node: slam, restart: on-failure, max_restarts: 3, after: {drive: started, static: ready}}
  other: {external: true}
"""  # noqa: E501 (a text as its reader has it)
