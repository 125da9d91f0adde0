"""Fleets: robots share some of their edges over Zenoh, for lookups between robots.

A robot sends TFMessages, encoded as in ROS (CDR), on the Zenoh key
``tfcompose/fleet/FLEET/ROBOT/tf``. Frames have their names in the fleet. On ``…/tf_static``, a
robot sends all its fixed edges twice a second. These messages also show that the others can reach
the robot.

``check`` lints a fleet file. ``share`` and ``robot`` send the edges of a robot. ``observe``
receives the edges of all robots.
"""
