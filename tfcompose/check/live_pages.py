"""The pages of what is found on a running system only: the doctor's."""

from __future__ import annotations

LIVE_PAGES = {
    "TF830": """Frames are in trees that nothing connects.

Every lookup between the two fails with "could not find a connection between", or "two or more unconnected trees". An
edge is missing: its publisher does not run, its name is misspelt, or one of the trees has a frame_prefix that the other
does not have. tfcompose tree --live shows both.""",
    "TF832": """Something else than transforms is published on a topic of TF.

ROS does not connect publishers and listeners of different types: nobody receives it. Often it is a bag of ROS 1 that
was converted with the old type, tf/msg/tfMessage.""",
    "TF833": """An edge's stamps are old when they come.

A lookup of now, or of a scan that was just measured, is "extrapolation into the future" until the edge has come up:
message filters wait, or drop. The node stamps with an old time, sends late, is overloaded, or its machine's clock is
behind. Listeners can look up the latest time (time 0), or wait with a timeout.""",
    "TF834": """The clock of another machine is not this one's.

Stamps of that machine's nodes are ahead or behind by as much, and lookups across machines extrapolate. It is measured
by DDS, which writes into each message when it was sent: one that arrives before it was sent comes from a clock that is
ahead; the least delay of all is what a clock is behind, or a network is slow. Use chrony or ptp on all machines.""",
    "TF835": """An edge is stamped ahead of time.

AMCL, SLAM and others date map → odom forward by a tolerance of up to a second, so that lookups of now find it. More
than that is a guess about where the robot will be, or a clock that is ahead.""",
    "TF836": """Nodes use simulated time, and it does not come.

A node with use_sim_time: true takes its time from /clock; until that comes its time is 0 and stands: timers do not
fire, and transforms are stamped 0. Start the simulator, play the bag with --clock, or set use_sim_time: false.""",
    "TF837": """Two nodes publish /clock.

Time jumps to and fro between the two, and with each jump back listeners forget what they had heard. It is a second
simulator, or a bag that is played with --clock beside one.""",
    "TF838": """A moving edge comes so seldom that lookups fail between two messages.

Between two messages tf2 interpolates, and after the last one it refuses: scans are dropped with "extrapolation into the
future", controllers act on an old pose, and frames jump. Odometry should come with 20 Hz (better 50), map → odom with
5 (better 10), and what other frames hang on with 5. A plan says what it expects: rate, at the edge.""",
    "TF839": """A moving edge comes often, and then not at all for a while.

Its mean rate looks right, and lookups fail all the same while it stays away. Its node blocks in a callback, its
computer or the network is overloaded, or a large message holds up the small ones.""",
    "TF840": """Data come in a frame that is not in the tree.

RViz shows nothing, and message filters drop each message: its frame_id is misspelt, has a leading / (which tf2 refuses
in lookups), lacks a frame_prefix, or the edge that leads to it is not published.""",
    "TF841": """The stamps of data and of the tree do not meet.

Data that are stamped later than the newest transform are "extrapolation into the future"; data that are older than the
10 s that listeners keep are "extrapolation into the past". Both come from stamps that do not mean the same: one is the
time of the measurement, the other that of sending; or one is another machine's, or the sensor's own clock.""",
    "TF842": """Joint states come, and nobody makes transforms of them.

The frames below moving joints are missing: robot_state_publisher does not run, or listens in another namespace.""",
    "TF843": """A robot state publisher waits for joint states that nobody sends.

Its fixed frames are there, and those below moving joints are not. Start joint_state_broadcaster (ros2_control) or
joint_state_publisher, and look whether the topic is in another namespace.""",
    "TF844": """Joint states come, and a moving joint of the description is not in them.

Its frame, and all below it, is missing. The joint has another name in the controller's configuration, or no state
interface there.""",
    "TF845": """Nobody publishes TF here.

Nothing runs, it publishes below a namespace (then --namespace), or it cannot be heard: another ROS_DOMAIN_ID, another
ROS_AUTOMATIC_DISCOVERY_RANGE, or a network that does not pass multicast.""",
    "TF908": """A ROS process on this machine is set up so that it cannot be heard here.

Processes hear each other with the same ROS_DOMAIN_ID, where neither has ROS_AUTOMATIC_DISCOVERY_RANGE=OFF, and surely
only with the same RMW_IMPLEMENTATION. What a process was started with is read from /proc, for one's own processes; of
other machines, and of containers, it cannot be seen.""",
    "TF849": """A node listens to /tf_static with durability volatile, and misses what was sent before it came.

Fixed frames are sent once and kept for those who come later, who get them only if they ask for durability
transient_local. tf2's own listeners do; a subscription of one's own has durability volatile unless it says otherwise,
and so has ros2 topic echo: ros2 topic echo --qos-durability transient_local --qos-reliability reliable /tf_static.""",
    "TF909": """Variables that set up ROS contradict each other, leave nobody to be heard, or say what cannot be.

A domain is a whole number from 0 to 232. RMW_IMPLEMENTATION names a middleware that has to be installed: ROS ends a
process that asks for another. ROS_LOCALHOST_ONLY=1 overrides ROS_AUTOMATIC_DISCOVERY_RANGE and is out of use since
Iron; OFF discovers nobody, not even on the same machine.""",
    "TF910": """A URDF that was to be written does not read back as the robot.

build --read-back reads each description with another parser and compares links, joints, poses, limits, masses and
shapes. Nothing is written then. It is a fault of tfcompose: report it, with the robot file.""",
}
