"""tfcompose's publishers: static edges, moving joints, simulated owners, robot description.

Each publisher is a process of the plan. Its command line is ``tfcompose static PLAN_FILE
PROCESS_NAME``, or the same with ``joints`` or ``simulate``.
"""
