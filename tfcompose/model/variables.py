"""Environment variables by which the launcher configures its processes."""

#: The id of the run, ROBOT@DOMAIN:ID. Every process of a run and its children have this variable.
RUN_ID = "TFCOMPOSE_RUN"
#: The name of the process in the plan.
PROCESS = "TFCOMPOSE_PROCESS"
#: The launcher of the run: its process id, and its start in clock ticks.
LAUNCHER = "TFCOMPOSE_LAUNCHER"
#: The descriptor of the pipe for events from the guard to the launcher.
EVENTS_FD = "TFCOMPOSE_EVENTS_FD"
#: The descriptor of the pipe for what the launcher tells the guard, or ``static``.
ORDERS_FD = "TFCOMPOSE_ORDERS_FD"
#: The descriptor of the previous guard's state as JSON; see ``tfcompose.guard.channel``.
MEMORY_FD = "TFCOMPOSE_MEMORY_FD"
#: Duration of the guard's observation before it reports that all is clear, in seconds.
SETTLE = "TFCOMPOSE_SETTLE_S"
#: Set for a guard that joins a running plan. It treats no publisher as present before the start.
JOINS = "TFCOMPOSE_GUARD_JOINS"
#: Set for a guard if remapping isolates the processes of its run.
REMAPPED = "TFCOMPOSE_REMAPPED"
#: The descriptor from which a held publisher reads ``GO``, the message to continue.
HOLD_FD = "TFCOMPOSE_HOLD_FD"
GO = b"go\n"
