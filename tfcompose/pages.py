"""What there is to say about each code, in Markdown: what is wrong, why it matters, what to do.

The first line is a sentence of its own. A rule's page is its docstring; the others are here. Loaded by ``explain`` and
for SARIF only.
"""

from __future__ import annotations

from tfcompose.catalogue import CATALOGUE, Family
from tfcompose.check import RULES

PAGES = {
    "TF001": """A file cannot be read, or is no text.

A robot file is UTF-8 text. Check the name, and that it is a file that you may read.""",
    "TF002": """The file is not YAML, not one document, or not a mapping.

The place is where reading stopped; the fault is there or just above. A robot file is one mapping and begins with
tfcompose: 1.""",
    "TF003": """A key is given twice in one mapping.

YAML readers take one of the two without a word. Keep the one that is meant.""",
    "TF004": """A key is a number, true, false, null, a list or a mapping.

Names are texts. Put the key in quotes.""",
    "TF005": """A value carries a tag that the language does not have.

Tags such as !degrees are not used: a text may carry a unit instead, 15 deg.""",
    "TF006": """A key has no value.

map: says nothing; map: {} says that there is such a frame. In an overlay, null removes a key.""",
    "TF007": """A number is not finite.

Infinity and NaN have no place in a robot; tf2 drops transforms that hold one.""",
    "TF008": """The file is larger, deeper, or by its aliases longer than a robot can be.

The limits keep a mistake, or a file that is meant to do harm, from taking all memory.""",
    "TF009": """There is no such profile.

Profiles are the entries of the section profiles.""",
    "TF010": """An overlay removes a key that is not there.

Probably the key has another name, or the overlay is out of date.""",
    "TF011": """<< does not name a mapping.

<< takes an alias of a mapping, or a list of such aliases.""",
    "TF012": """A comment allows a finding that is not there.

The fault has been mended, or the code is another. Remove the comment, so that it does not hide the next fault.""",
    "TF013": """A comment allows a finding and does not say why.

Write the reason behind it: allow TF401 because the lens is turned.""",
    "TF014": """An overlay sets a value that is there already.

It hides that the value is no longer meant to differ, or that the overlay was meant for another key.""",
    "TF015": """Files include each other, or are too many.

A file cannot be laid over itself.""",
    "TF016": """A setting on the command line is not PATH=VALUE.

PATH has dots between its keys: sensors.camera.tf=driver.""",
    "TF017": """An entry under rules is no code, or one that cannot be set.

Findings about text and keys (TF0 and TF1) always count, and those without whose end there is no robot to build: two
parents, cycles, frames and owners that are not there, processes that wait for each other.""",
    "TF018": """A file is not XML, not a robot, or declares entities.

The place is where reading stopped. A URDF is one <robot>; with xacro the message is xacro's own.""",
    "TF019": """A file or folder that ${file(…)} or cwd names is not there.

A path is relative to the file that writes it, not to the folder that tfcompose is started in.""",
    "TF101": """A key is not known here.

Probably it is misspelt; unknown keys are refused, because a key that is silently dropped is a frame in the wrong
place.""",
    "TF102": """A key is missing.

Without it the entry has no meaning.""",
    "TF103": """A value is of another kind than expected: a text for a number, a list of another length.""",
    "TF104": """A unit is not known, or is of another kind of quantity.

Bare numbers are SI: m, rad, kg, s, Hz. A text may carry a unit: 30 cm, 15 deg, 50 Hz, 200 ms.""",
    "TF105": """An expression ${…} cannot be computed.

It may hold vars, quantities, pi, + - * / ( ), and sin cos tan sqrt radians degrees.""",
    "TF106": """A value is not one of those that are allowed here.""",
    "TF107": """Two keys exclude each other.

A rotation is written in one way, a process runs in one way, a shape has one form.""",
    "TF304": """A robot is to be isolated and has no name for it.

isolate moves topics below the namespace, or makes the namespace the frames' prefix. Give ros: {namespace: robot1}.""",
    "TF312": """A part has another clock, domain or discovery than the robot that holds it.

All processes of a plan share them. Set it in the robot that holds the part, or leave it out of the part's file.""",
    "TF313": """A part that is bolted on has no root, or several.

The part's pose is that of its root. Say which frame that is with root: what is not below it is left out. A root that
is shared needs no parent: it is the holder's frame.""",
    "TF315": """A joint is not in the description that a stock robot_state_publisher gets.

ros: {state_publisher: stock} hands everything below the base to it, and nothing else publishes joints then. Choose a
base above the joint, or leave joints to tfcompose.""",
    "TF316": """A shared frame is in the description that a stock robot_state_publisher gets.

It writes its frame_prefix in front of every frame, shared or not. Leave joints to tfcompose, which knows the
difference.""",
    "TF330": """A node publishes an edge by default that somebody else owns, and tfcompose cannot switch it off.

Both would publish, and tf2 takes the last writer. tfcompose writes the switch into the parameters of processes that it
starts itself; the help names the parameter for the others, or says that there is none.""",
    "TF331": """A node publishes an edge by default that nobody declared.

Declare the edge with the node's process as its owner, so that the guard expects it; or give the parameter that stops
it. Edges that come and go, such as those of tags, are allowed in the guard.""",
    "TF332": """An edge's owner is not known to publish it.

The process has nodes of which it is known what they publish, or several nodes, and none of them publishes this edge.
The guard blames whoever sends it. Name another owner, or say which node does: publishes: [{parent, child, off}].""",
    "TF333": """A parameter of a node says something else than the tree.

Names of frames, and the switches of what a node publishes, follow from the tree and its owners, and are written by
tfcompose. Remove the parameter, or change the tree.""",
    "TF402": """A quaternion does not have length 1.

It is no rotation. A few digits that are missing change the angle by as much; a length far from 1 says that an order is
wrong (it is x, y, z, w) or a number is. tf2 on Jazzy brings it to length 1 and says nothing; stricter readers drop
it.""",
    "TF403": """A matrix is no rotation.

Its rows are not orthonormal, or it mirrors. It holds three rows; column i is the child's axis i in the parent.""",
    "TF404": """A pose cannot be solved.

relative_to and place go through fixed edges only: what moves has no pose before the robot runs.""",
    "TF405": """A sensor is placed through values that its driver replaces.

The pose is that of a frame whose edge the driver publishes with its own unit's calibration. The mount is solved with
the nominal values, so the frame ends up off by the difference. Give this unit's values under sensors.NAME.frames.""",
    "TF502": """One name is used for two things.

Sensors and processes share one name space, because a sensor's driver is a process; joints share another.""",
    "TF505": """A part brings a frame or a joint of a name that is taken.

Frames of all robots in one file need different names, because listeners know frames by nothing else; so do the joints
of one robot, which joint states and the URDF know by name. Give the part a prefix; or, if both mean one and the same
frame, name it under ros: shared_frames.""",
    "TF601": """There is no such preset.

tfcompose presets lists those that come with it; preset_path names folders with your own, VENDOR/MODEL.yaml.""",
    "TF603": """A preset does not have this option, or not this value of it.""",
    "TF604": """A driver cannot do what is asked.

It has no switch for its frames, there is no driver, or the parameter is one that tfcompose computes.""",
    "TF605": """The preset does not know where a frame is, and a zero would be a lie.

The vendor publishes no value, or only the device knows its own. Measure it, or read it from the running driver with
tfcompose echo, and give it under sensors.NAME.frames; or choose options without that frame.""",
    "TF606": """A preset contradicts itself: it names a frame or an option that it does not have, or is no tree.""",
    "TF607": """A preset of your own has the name of one that comes with tfcompose, and stands before it.

If that is meant, allow the finding; else give it another name, so that a reader knows which one is used.""",
    "TF610": """A calibration file, or a value in it, cannot be read.

The note shows where. An entry holds numbers: no expressions, no units; of tags only xacro's !degrees and !radians.""",
    "TF611": """A calibration file is in no format that is known, or not in the one that is named.

Formats: autoware, easy_handeye2, moveit, kalibr, matrix, transform_stamped. Left out, the format is recognised.""",
    "TF612": """A calibration file holds no pose of this frame in its parent.

The entry is that of the edge: its parent, and the frame or one of those inside the sensor. Where the file has other
names, pick the entry with parent: and child:.""",
    "TF613": """Several entries of calibration files fit one edge.

Which one is right cannot be guessed. Pick one with parent: and child:, or remove the others.""",
    "TF614": """A calibration is no rigid transform.

A quaternion has length 1; the rows of a rotation are orthonormal; the last row of a 4×4 matrix is 0 0 0 1, and the
position stands in its last column. Copy all digits.""",
    "TF619": """Nothing in the robot takes an entry of a file under calibrations.

It is the pose of a frame that is not there, or of one that is no mount. Its name may be misspelt, or it is out of
date.""",
    "TF703": """A stand-in names a joint that does not move or does not exist.""",
    "TF719": """An element of a raw XML block has no place there.

A block stands beside links and joints in the URDF: <gazebo>, <transmission>, and what other programs read. Links and
joints are written under links: and joints:, so that they are checked and have an owner.""",
    "TF720": """An element or an attribute is not one of URDF's.

Readers pass over it without a word: with <orign> a joint is at its parent's origin. An error where a known name is
misspelt; else it may be somebody's extension, and is a warning.""",
    "TF721": """A value of a URDF is missing, or is none.

Numbers are SI: m, rad, kg. Readers refuse the robot, take a default without a word, or compute with what is there.""",
    "TF722": """Two links, two joints or two materials of a URDF have one name.

Readers refuse the robot or keep one of the two. Often a xacro macro was used twice with one prefix, or a file of
materials was included twice; for materials it is a warning, since what is built of the robot is right.""",
    "TF723": """The file of a mesh or a texture is not there.

The body does not appear, and the collision with it is not checked. A relative path begins at the file that writes
it. A warning where a checkout without Git LFS has a pointer in the file's place: what is built is right, once the file
is fetched.""",
    "TF724": """A package is not to be found here.

It was looked for where packages: says, then in share/PACKAGE of each folder in AMENT_PREFIX_PATH; a file's own package
is also the one around it, by its package.xml. Source the workspace's setup file first, or name the folder:
packages: {my_robot_description: ../description}.""",
    "TF725": """A mass is to be spread over a mesh that has no volume.

Only a closed mesh has one whose triangles all face outwards, or all inwards, and only one that is found here. Mend it
(normals: recalculate outside), give a closed collision shape (the tensor is
computed from collision shapes where there are any), or give mass and inertia from CAD.""",
    "TF726": """A mesh is to be addressed by package, and is in none.

build --mesh package needs a package.xml in a folder above the file, or an address that begins with package://.""",
    "TF727": """A joint says something that joints of its type do not have.

A fixed or floating joint has no axis, limits or mimic, and a continuous one turns for ever, whatever its lower and
upper limit: it is not written, or no reader takes it. Often the type is what is wrong.""",
    "TF729": """A raw XML block has $(find …), or another substitution of xacro files or launch files.

A block stands in the URDF as it is written, and no reader of a URDF expands that: Gazebo looks for a folder called
$(find my_robot). Write the path itself; a variable keeps it in one place, and --set changes it on another machine.""",
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
    "TF901": """ROS 2 is missing, or cannot be used.""",
    "TF902": """A plan cannot be used: it is not one, not whole, or of another version.

Build it again.""",
    "TF903": """A rule crashed.

The other rules went on. This is a fault of tfcompose; please report it with the robot file.""",
    "TF904": """A xacro file is to be read, and xacro is not installed.

It comes with ROS, and from PyPI: pip install xacro.""",
    "TF905": """An inertia is to be computed from a mesh, and trimesh is not installed.

pip install 'tfcompose[mesh]', or give the inertia.""",
    "TF906": """A bag is to be read, and the package rosbags is not there.

pip install 'tfcompose[bag]' brings it. ROS is not needed to read bags.""",
    "TF907": """A bag cannot be read: it is not there, is damaged, is none of ROS 2, or holds no TF.

MCAP and SQLite bags are read, as folders with metadata.yaml or as single .mcap and .db3 files.""",
    "TF908": """A ROS process on this machine is set up so that it cannot be heard here.

Processes hear each other with the same ROS_DOMAIN_ID, where neither has ROS_AUTOMATIC_DISCOVERY_RANGE=OFF, and surely
only with the same RMW_IMPLEMENTATION. What a process was started with is read from /proc, for one's own processes; of
other machines, and of containers, it cannot be seen.""",
    "TF909": """Variables that set up ROS contradict each other, leave nobody to be heard, or say what cannot be.

A domain is a whole number from 0 to 232. RMW_IMPLEMENTATION names a middleware that has to be installed: ROS ends a
process that asks for another. ROS_LOCALHOST_ONLY=1 overrides ROS_AUTOMATIC_DISCOVERY_RANGE and is out of use since
Iron; OFF discovers nobody, not even on the same machine.""",
    "TF910": """A URDF that was to be written does not read back as the robot.

build --read-back reads each description with another parser and compares links, joints, poses, limits, masses and
shapes. Nothing is written then. It is a fault of tfcompose: report it, with the robot file.""",
}


def page(code: str) -> str:
    """Return the page of a code.

    Raises:
        KeyError: if there is no such code.
    """
    return RULES[code].page if code in RULES else PAGES[code]


def table(family: Family | None = None) -> str:
    """Return all codes, or those of a family, as a table in Markdown: code, name, severity, first line of the page."""
    listed = [code for code in CATALOGUE.values() if family in {None, code.family}]
    rows = [f"| {one.code} | {one.name} | {one.severity} | {page(one.code).splitlines()[0]} |\n" for one in listed]
    return "".join(["| code | name | severity | what is wrong |\n", "|---|---|---|---|\n", *rows])
