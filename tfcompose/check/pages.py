"""What there is to say about each code: for a rule its docstring, for the others the text here.

A page's first line says what is wrong; what follows says why it matters and what to do.
"""

from __future__ import annotations

import inspect

from tfcompose.check.check import RULES
from tfcompose.check.live_pages import LIVE_PAGES


def page(code: str) -> str:
    """Return the page of a code.

    Raises:
        KeyError: if there is no such code.
    """
    for rule in RULES:
        if rule.code == code:
            return inspect.getdoc(rule.check) or ""
    return PAGES[code]


def rule_table() -> str:
    """Return the rules as a table in Markdown: code, name, severity, and the first line of the page."""
    rows = ["| code | name | severity | what is wrong |", "|---|---|---|---|"]
    for rule in sorted(RULES, key=lambda rule: rule.code):
        first = page(rule.code).partition("\n")[0]
        rows.append(f"| {rule.code} | {rule.name} | {rule.severity} | {first} |")
    return "\n".join(rows) + "\n"


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
    "TF019": """A file or folder that ${file(…)} names is not there.

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
    "TF333": """A parameter of a node says something else than the tree.

Names of frames, and the switches of what a node publishes, follow from the tree and its owners, and are written by
tfcompose. Remove the parameter, or change the tree.""",
    "TF330": """A node publishes an edge by default that somebody else owns, and tfcompose cannot switch it off.

Both would publish, and tf2 takes the last writer. tfcompose writes the switch into the parameters of processes that it
starts itself; the help names the parameter for the others, or says that there is none.""",
    "TF331": """A node publishes an edge by default that nobody declared.

Declare the edge with the node's process as its owner, so that the guard expects it; or give the parameter that stops
it. Edges that come and go, such as those of tags, are allowed in the guard.""",
    "TF332": """An edge's owner is not known to publish it.

The process has nodes of which it is known what they publish, or several nodes, and none of them publishes this edge.
The guard blames whoever sends it. Name another owner, or say which node does: publishes: [{parent, child, off}].""",
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
    "TF505": """A part brings a frame of a name that is taken.

Frames of all robots in one file need different names, because listeners know frames by nothing else. Give the part a
prefix; or, if both mean one and the same frame, name it under ros: shared_frames.""",
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
    "TF315": """A joint is not in the description that a stock robot_state_publisher gets.

ros: {state_publisher: stock} hands everything below the base to it, and nothing else publishes joints then. Choose a
base above the joint, or leave joints to tfcompose.""",
    "TF316": """A shared frame is in the description that a stock robot_state_publisher gets.

It writes its frame_prefix in front of every frame, shared or not. Leave joints to tfcompose, which knows the
difference.""",
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
    "TF722": """Two links or two joints of a URDF have one name.

Readers refuse the robot or keep one of the two. Often a xacro macro was used twice with one prefix.""",
    "TF723": """The file of a mesh or a texture is not there.

The body does not appear, and the collision with it is not checked. A relative path begins at the file that writes
it.""",
    "TF724": """A package is not to be found here.

It was looked for where packages: says, then in share/PACKAGE of each folder in AMENT_PREFIX_PATH. Source the
workspace's setup file first, or name the folder: packages: {my_robot_description: ../description}.""",
    "TF725": """A mass is to be spread over a mesh that has no volume.

Only a closed mesh has one, and only one that is found here. Close it, give a closed collision shape (the tensor is
computed from collision shapes where there are any), or give mass and inertia from CAD.""",
    "TF726": """A mesh is to be addressed by package, and is in none.

build --mesh package needs a package.xml in a folder above the file, or an address that begins with package://.""",
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
    "TF810": """An executable was not found.

The finding says where it was looked for. A package's programs are found once its setup file was sourced.""",
    "TF811": """An edge was not published while the plan ran.

Its owner is named: a process that somebody else starts may not be running, or its node has another name.""",
    "TF813": """A process waits for one that is not there.""",
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
    "TF831": """tf2 refuses a transform that is published.

A value is not a finite number, the quaternion is zero, a name is empty, or the frame is its own parent: the frame is
not there for any listener. Or the quaternion is not of length 1: tf2 on Jazzy brings it to that length when it takes
it, so that RViz shows the frame, and its angle is a guess; stricter readers, and tfcompose's buffer, drop it.""",
    "TF846": """A frame is not where the robot's file says.

verify compares what is fixed: millimetres and degrees beyond --tolerance are told. A build that is older than the file,
another calibration, or a driver with values of its own are the usual reasons.""",
    **LIVE_PAGES,
    "TF901": """ROS 2 is missing, or cannot be used.""",
    "TF902": """A plan cannot be used: it is not one, not whole, or of another version.

Build it again.""",
    "TF904": """A xacro file is to be read, and xacro is not installed.

It comes with ROS, and from PyPI: pip install xacro.""",
    "TF905": """An inertia is to be computed from a mesh, and trimesh is not installed.

pip install 'tfcompose[mesh]', or give the inertia.""",
    "TF906": """A bag is to be read, and the package rosbags is not there.

pip install 'tfcompose[bag]' brings it. ROS is not needed to read bags.""",
    "TF907": """A bag cannot be read: it is not there, is damaged, is none of ROS 2, or holds no TF.

MCAP and SQLite bags are read, as folders with metadata.yaml or as single .mcap and .db3 files.""",
    "TF903": """A rule crashed.

The other rules went on. This is a fault of tfcompose; please report it with the robot file.""",
}
