"""The plan: what is started, and which TF edge each process owns.

The plan is the border between the compiler and everything that runs on a robot; ``tfcompose.plan.file`` writes and
reads it. Poses are the pose of the child in the parent: metres, unit quaternions x y z w. Rates are
in hertz.
"""

from tfcompose.plan.edge import EDGE_KINDS, SILENT_AT_LEAST_S, SILENT_PERIODS, SLOW_BELOW, EdgeKind, Joint, PlanEdge
from tfcompose.plan.plan import DESCRIPTION, VERSION, Plan
from tfcompose.plan.policy import (
    FENCES,
    Claim,
    FenceWay,
    GuardMode,
    GuardPolicy,
    OnViolation,
    RosSettings,
    UnknownEdges,
    switch_text,
)
from tfcompose.plan.process import (
    KNOWN,
    LIFECYCLE_STATES,
    LOG_LEVELS,
    PROCESS_KINDS,
    READY_KINDS,
    STOP_SIGNALS,
    Driven,
    PlanProcess,
    ProcessKind,
    Ready,
    ReadyKind,
    Simulation,
    StopRule,
    Sweep,
    told_at_start,
)

__all__ = [
    "DESCRIPTION",
    "EDGE_KINDS",
    "FENCES",
    "KNOWN",
    "LIFECYCLE_STATES",
    "LOG_LEVELS",
    "PROCESS_KINDS",
    "READY_KINDS",
    "SILENT_AT_LEAST_S",
    "SILENT_PERIODS",
    "SLOW_BELOW",
    "STOP_SIGNALS",
    "VERSION",
    "Claim",
    "Driven",
    "EdgeKind",
    "FenceWay",
    "GuardMode",
    "GuardPolicy",
    "Joint",
    "OnViolation",
    "Plan",
    "PlanEdge",
    "PlanProcess",
    "ProcessKind",
    "Ready",
    "ReadyKind",
    "RosSettings",
    "Simulation",
    "StopRule",
    "Sweep",
    "UnknownEdges",
    "switch_text",
    "told_at_start",
]
