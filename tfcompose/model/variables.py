"""Environment variables through which the launcher configures its processes."""

#: Every process of a run carries its id, ROBOT@DOMAIN:ID, and so do its children.
RUN_ID = "TFCOMPOSE_RUN"
#: The process of the plan that it belongs to.
PROCESS = "TFCOMPOSE_PROCESS"
#: The launcher of the run: its process number, and when it began (clock ticks).
LAUNCHER = "TFCOMPOSE_LAUNCHER"
#: The descriptor of the pipe for what the guard tells the launcher.
EVENTS_FD = "TFCOMPOSE_EVENTS_FD"
#: The descriptor of the pipe for what the launcher tells the guard.
ORDERS_FD = "TFCOMPOSE_ORDERS_FD"
#: The descriptor of what the guard before this one left, in JSON; see ``tfcompose.guard.channel``.
MEMORY_FD = "TFCOMPOSE_MEMORY_FD"
#: For how many seconds the guard is to look before it says that all is clear.
SETTLE = "TFCOMPOSE_SETTLE_S"
#: Set for a guard that joins a plan that runs already: nobody was there before the start, as it
#: sees it.
JOINS = "TFCOMPOSE_GUARD_JOINS"
#: Set for a guard where the processes of its run are fenced off by remapping.
REMAPPED = "TFCOMPOSE_REMAPPED"
#: The descriptor from which a publisher that is held before it joins ROS reads the word to go on,
#: ``GO``.
HOLD_FD = "TFCOMPOSE_HOLD_FD"
GO = b"go\n"
