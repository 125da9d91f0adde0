"""What is found in a robot as it is meant: edges, owners, poses, presets, bodies."""

from __future__ import annotations

PAGES = {
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
    "TF727": """A joint says something that joints of its type do not have.

A fixed or floating joint has no axis, limits or mimic, and a continuous one turns for ever, whatever its lower and
upper limit: it is not written, or no reader takes it. Often the type is what is wrong.""",
    "TF729": """A raw XML block has $(find …), or another substitution of xacro files or launch files.

A block stands in the URDF as it is written, and no reader of a URDF expands that: Gazebo looks for a folder called
$(find my_robot). Write the path itself; a variable keeps it in one place, and --set changes it on another machine.""",
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
}
