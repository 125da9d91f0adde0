"""What ``tfcompose import`` does: from a URDF that was read to the text of a robot file.

``convert`` looks for the sensors in it and takes down what a robot file has no place for; ``robot_file`` writes the
text. It may import what resolves and reads robots; only the command imports it.
"""
