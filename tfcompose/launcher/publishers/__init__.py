"""tfcompose's own publishers.

Static edges, moving joints, simulations, and the robot's description.

Each is a process of the plan: ``tfcompose static PLAN_FILE PROCESS_NAME``, ``joints``,
``simulate``.
"""
