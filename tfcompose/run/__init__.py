"""What runs on the robot: launcher, publishers and guard. It knows the plan, not the compiler.

The three are processes of their own and know nothing of each other but what stands here: lines of JSON on pipes
(``events``, ``orders``), the folder of a running robot (``place``), and how own processes begin.
"""
