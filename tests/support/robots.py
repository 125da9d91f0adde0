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
EXTERNAL = ROVER.replace("{simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}", "{external: true, node: diff_drive}")
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
"""
