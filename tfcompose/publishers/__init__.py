"""tfcompose's own publishers: fixed edges, moving joints, stand-ins, and the robot's description.

Each is a process of the plan: ``python -m tfcompose.publishers.static PLAN_FILE PROCESS_NAME``, ``.joints``,
``.simulate``. They know the plan, and neither the launcher nor the guard.
"""
