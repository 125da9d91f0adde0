"""Source text of helper functions in Python launch files, and the names that the files import."""

from __future__ import annotations

from tfcompose.launcher.program import ANYWHERE_PARTS
from tfcompose.model.plan import STOCK_DESCRIPTION

#: Names that a launch file may need, by the module that contains them.
IMPORTS = {
    "launch.actions": (
        "DeclareLaunchArgument",
        "EmitEvent",
        "ExecuteProcess",
        "GroupAction",
        "IncludeLaunchDescription",
        "OpaqueFunction",
        "RegisterEventHandler",
        "SetEnvironmentVariable",
        "Shutdown",
        "TimerAction",
    ),
    "launch.conditions": ("IfCondition", "UnlessCondition"),
    "launch.event_handlers": ("OnProcessExit", "OnProcessStart"),
    "launch.events": ("matches_action",),
    "launch.launch_description_sources": ("AnyLaunchDescriptionSource",),
    "launch.substitutions": (
        "AndSubstitution",
        "EnvironmentVariable",
        "EqualsSubstitution",
        "LaunchConfiguration",
        "NotEqualsSubstitution",
        "NotSubstitution",
        "OrSubstitution",
        "PythonExpression",
    ),
    "launch_ros.actions": (
        "ComposableNodeContainer",
        "LifecycleNode",
        "LoadComposableNodes",
        "Node",
        "PushRosNamespace",
        "SetParameter",
        "SetRemap",
    ),
    "launch_ros.descriptions": ("ComposableNode",),
    "launch_ros.event_handlers": ("OnStateTransition",),
    "launch_ros.events.lifecycle": ("ChangeState",),
    "launch_ros.parameter_descriptions": ("ParameterValue",),
    "lifecycle_msgs.msg": ("Transition",),
}
#: Source text of helper functions. A launch file contains the functions that it calls.
HELPERS = {
    "process": (
        f'''
def process(name, **more):
    """One of tfcompose's own, or one that only the plan knows how to start."""
    start = (
        "{ANYWHERE_PARTS[0]}"
        "{ANYWHERE_PARTS[1]}"
    )
    command = [sys.executable, "-c", start, "exec", str(BUILD / "plan.json"), name]
    return ExecuteProcess(cmd=command, name=name, output="screen", **more)
'''
    ),
    "description": (
        f'''
def description():
    """What robot_state_publisher is given."""
    urdf = (BUILD / "{STOCK_DESCRIPTION}").read_text(encoding="utf-8")
    return ParameterValue(urdf, value_type=str)
'''
    ),
    "fixed": (
        '''
def fixed(name, parent, child, xyz, quat_xyzw, **more):
    """A fixed edge that is not in the URDF."""
    keys = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
    pose = [word for key, value in zip(keys, (*xyz, *quat_xyzw)) for word in (key, str(value))]
    ends = ["--frame-id", parent, "--child-frame-id", child]
    program = {"package": "tf2_ros", "executable": "static_transform_publisher"}
    return Node(**program, name=name, arguments=pose + ends, output="screen", **more)
'''
    ),
    "managed": (
        '''
def change(node, transition):
    matcher = matches_action(node)
    return EmitEvent(event=ChangeState(lifecycle_node_matcher=matcher, transition_id=transition))


def managed(node, active):
    """The node, which is configured when it was started, and activated once it is inactive."""
    configure = change(node, Transition.TRANSITION_CONFIGURE)
    yield node
    if active:
        activate = change(node, Transition.TRANSITION_ACTIVATE)
        then = OnStateTransition(
            target_lifecycle_node=node,
            start_state="configuring",
            goal_state="inactive",
            entities=[activate],
        )
        yield RegisterEventHandler(then)
    yield RegisterEventHandler(OnProcessStart(target_action=node, on_start=[configure]))
'''
    ),
    "included": (
        '''
def included(package, name, arguments, settings, **more):
    """A package's launch file, anywhere in its share folder, grouped with its settings."""

    def found(context):
        share = Path(get_package_share_directory(package))
        direct = [file for file in (share / name, share / "launch" / name) if file.is_file()]
        file = (direct or sorted(share.rglob(name)) or [share / name])[0]
        source = AnyLaunchDescriptionSource(str(file))
        return [IncludeLaunchDescription(source, launch_arguments=arguments)]

    return GroupAction([*settings, OpaqueFunction(function=found)], **more)
'''
    ),
}
