"""Several robots: a few edges leave each of them over Zenoh, and are looked up together elsewhere.

On the key ``tfcompose/fleet/FLEET/ROBOT/tf`` are TFMessages as ROS has them, in CDR, with the
names of frames that they have in the fleet; ``…/tf_static`` holds all fixed edges, twice a second,
and says by that that the robot is reached.

``check`` lints the file of a fleet, ``share`` and ``robot`` send from a robot, ``observe``
receives anywhere.
"""
