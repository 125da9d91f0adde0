"""What is found before, and while, a robot runs: by the launcher, the guard, and who looks at the live tree."""

from __future__ import annotations

PAGES = {
    "TF801": """A node publishes an edge that another process owns.

tf2 takes whatever came last, so the frame jumps between two values. The finding names the node. End it, or switch its
TF off.""",
    "TF802": """A frame was seen under a second parent.

tf2 keeps the parent of the newest message: everything below the frame jumps.""",
    "TF803": """An edge was seen that nobody declared.

Declare it, or allow it under guard: allow. guard: unknown_edges says how much it matters.""",
    "TF804": """An owner sends nothing any more, or is gone.

For an edge with a rate: nothing came for four periods, and at least 0.6 s. For fixed edges: the publisher left.""",
    "TF805": """An owner sends less often than its edge declares.

Listeners interpolate over longer gaps, and lookups near now fail. Below 80 % of the declared rate over 2 s.""",
    "TF806": """A publisher on /tf_static is volatile.

Listeners ask for transient_local and DDS does not connect the two: nobody receives these frames.""",
    "TF807": """An edge of the plan was published before the start.

Starting would give it two publishers. End the node that is named, or make it the owner.""",
    "TF808": """A process ended that should run, or could not be started.

Its last lines are with the finding.""",
    "TF809": """An owner sends its edge on the wrong topic.

Fixed edges belong on /tf_static, moving ones on /tf; tf2 throws its history away when an edge changes between them.""",
    "TF810": """An executable, or the folder that a process runs in, was not found.

The finding says where it was looked for. A package's programs are found once its setup file was sourced.""",
    "TF811": """An edge was not published while the plan ran.

Its owner is named: a process that somebody else starts may not be running, or its node has another name.""",
    "TF813": """A process waits for one that is not there, or for its end where it has none.

tfcompose's own processes, and those that somebody else starts, are never done; they are started, and ready.""",
    "TF814": """There is no live pose of one frame in another.

A frame is unknown, the two are in two trees, their edges have no time in common, or nothing is published at all.""",
    "TF816": """A path that is known at the start only stands where nobody can fill it in.

${file(…)}, ${build_dir} and ${params_file} are filled in when the plan is started: in the arguments and the environment
of a process, and in parameters of a process with one node that tfcompose starts itself. A launch file, a command or
somebody else's process takes a path as an argument; and without parameters there is no ${params_file}.""",
    "TF817": """A process is not ready in time.

The finding says what its ``ready`` waits for, what was seen instead, and what the process said last. Processes that
wait for it wait on.""",
    "TF819": """The plan does not say what this machine starts.

A process may name a ``host:``. ``up --host NAME`` starts that host's share; without it, the machine's own name decides,
and a machine that the plan does not name starts what has no host. All others are expected, and the guard sees them.""",
    "TF820": """Somebody publishes an edge that closes a loop.

The frames of the loop are each other's ancestors; tf2 finds no way through them, and every lookup that needs one fails.
The finding names the loop and who closes it: end that node, or turn its edge round. That an edge is allowed, or need
not be declared, does not make a loop right.""",
    "TF821": """Somebody publishes a frame in itself.

Parent and child have one name; tf2 drops the transform and writes an error for each. The node has two parameters for
frames that are the same, probably.""",
    "TF822": """Two nodes publish one frame that the plan does not have.

It is allowed, or need not be declared, but tf2 takes whatever came last, so the frame jumps between the two.""",
    "TF823": """An owner sends an edge with the same stamp again and again.

tf2 keeps the first and drops the others, with a warning for each: it looks like a rate that is not there. The stamp is
that of the measurement; where there is no new one, nothing needs to be sent.""",
    "TF824": """An owner's stamps go back in time.

tf2 sorts such a transform in behind newer ones, or drops it when it is older than its memory of 10 s. A bag is being
played, a clock was set, or several threads stamp and send in another order. Where simulated time itself goes back,
nothing is said.""",
    "TF825": """An owner's stamps are of another clock than the plan's.

They are more than 10 s off: simulated time in a plan on the system's time or the other way round, no stamp at all, or
a host whose clock is not in sync. No lookup brings such an edge together with the others.""",
    "TF826": """A node writes TF best effort.

Listeners ask for reliable, so none of them accepts it, and nothing arrives. Publish as tf2_ros does: reliable, on
/tf_static transient_local too.""",
    "TF827": """A node of an isolated plan writes the global /tf or /tf_static.

The plan keeps its transforms on topics of its own, so that robots do not hear each other; this node's go to all the
others instead, and are missing here. Start it with the remappings /tf:=… and /tf_static:=….""",
    "TF828": """A driver sends a frame elsewhere than its preset has it.

Calibration moves a nominal frame by millimetres; beyond 2 cm or 5 degrees the device is another model, or its
calibration is broken. A frame that the preset calls exact, such as the turn of an optical frame, may differ by 1 mm and
0.2 degrees. Name the right preset, or give the unit's own values under sensors.NAME.frames.""",
    "TF829": """A node has not taken a switch that the plan wrote for it.

The parameter was read back from the running node, after it appeared: the value is another one, or there is no such
parameter. Somebody else started the node, or a launch file overrides it, or this version has another switch. What the
node publishes is then not what the plan says.""",
    "TF830": """Frames are in trees that nothing connects.

Every lookup between the two fails with "could not find a connection between", or "two or more unconnected trees". An
edge is missing: its publisher does not run, its name is misspelt, or one of the trees has a frame_prefix that the other
does not have. tfcompose tree --live shows both.""",
    "TF831": """tf2 refuses a transform that is published.

A value is not a finite number, the quaternion is zero, a name is empty, or the frame is its own parent: the frame is
not there for any listener. Or the quaternion is not of length 1: tf2 on Jazzy brings it to that length when it takes
it, so that RViz shows the frame, and its angle is a guess; stricter readers, and tfcompose's buffer, drop it.""",
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
than that, or odometry and joints that are ahead at all, is a guess about where the robot will be, or a clock that is
ahead: a lookup for a scan gets the pose from before the scan, and what was seen lands beside where it is.""",
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
    "TF846": """A frame is not where the robot's file says.

verify compares what is fixed: millimetres and degrees beyond --tolerance are told. A build that is older than the file,
another calibration, or a driver with values of its own are the usual reasons.""",
    "TF849": """A node listens to /tf_static with durability volatile, and misses what was sent before it came.

Fixed frames are sent once and kept for those who come later, who get them only if they ask for durability
transient_local. tf2's own listeners do; a subscription of one's own has durability volatile unless it says otherwise,
and so has ros2 topic echo: ros2 topic echo --qos-durability transient_local --qos-reliability reliable /tf_static.""",
    "TF850": """An owner replaced a latched edge with its next message before anybody heard it.

A publisher on /tf_static keeps its last message for those that find it later, and to be found takes a moment. What it
sent before that one, in messages of their own, nobody gets any more. A subscriber that is counted before sending may
be a listener of the node's own. Send all fixed edges in each message, as tf2's StaticTransformBroadcaster does.""",
    "TF851": """A process has a key that does nothing there.

A process that somebody else starts is neither restarted nor stopped here, and its environment, folder, remappings and
log level are for whoever starts it; a stand-in has no parameters of the node that it stands in for. Keys of a base file
that an overlay turns into a stand-in, or leaves to somebody else, are not meant: they say how the base starts it.""",
}
