"""tfcompose's own publishers: static edges, moving joints, simulations, robot description.

Each is a process of the plan: ``tfcompose static PLAN_FILE PROCESS_NAME``, ``joints``,
``simulate``.
"""
