"""The words of a plan: each enumeration of it and of the language once, as a Literal; ``get_args`` gives its words.

They are types of the plan's fields, of messages between processes, and of the language's models alike.
"""

from __future__ import annotations

from typing import Literal

#: Who moves an edge: nobody, joint states, or its owner.
EdgeKind = Literal["static", "joint", "dynamic"]
#: How a joint moves; of planar and floating ones joint states say nothing.
JointType = Literal["revolute", "continuous", "prismatic", "planar", "floating"]

#: What a process is: one of tfcompose's own, one that somebody else starts, or a program.
ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run"]
#: After which ends a process is started again.
RestartPolicy = Literal["no", "on-failure", "always"]
#: The first signal that ends a process.
StopSignal = Literal["SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2"]
#: What makes a process ready.
ReadyKind = Literal["edges", "topic", "service", "lifecycle", "log", "exit", "time"]
#: What must have happened to another process before one is started.
StartCondition = Literal["started", "ready", "done"]
#: The states of a lifecycle node that it can be brought into, or be waited for in.
LifecycleState = Literal["inactive", "active"]
#: How much a node's loggers write.
LogLevel = Literal["debug", "info", "warn", "error", "fatal"]
#: What a stand-in does.
SimulationKind = Literal["circle", "fixed", "joints"]
#: How well the pose of a frame is known that a driver publishes.
PoseKnowledge = Literal["exact", "nominal"]

#: Whose time the whole plan runs by.
Clock = Literal["wall", "sim"]
#: How far ROS looks for other nodes; None in a plan: as far as the environment says.
Discovery = Literal["localhost", "subnet", "off"]
#: What keeps several robots in one domain apart: topics below their namespaces, or frames with a prefix.
Isolation = Literal["none", "topics", "frames", "both"]
#: Who publishes what is ours below the base.
StatePublisher = Literal["tfcompose", "stock"]
#: Who publishes the frames inside a sensor.
SensorPublisher = Literal["driver", "tfcompose"]

#: What the guard does with what a process sends and does not own: nothing, report it, or hold it back.
GuardMode = Literal["off", "watch", "strict"]
#: What an edge is that nobody declared.
UnknownEdges = Literal["ignore", "warn", "error"]
#: What follows a violation: words, the end of the process that surely did it, or the end of everything.
OnViolation = Literal["report", "stop-offender", "stop"]
#: How a strict guard fences processes off; auto: by partition where their rmw is Fast DDS, else by remapping.
FenceWay = Literal["auto", "partition", "remap"]
