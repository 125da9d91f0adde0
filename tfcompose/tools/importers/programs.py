"""Programs that a script or a launch file starts, as entries of a robot file.

A ``static_transform_publisher`` is a frame, a ``robot_state_publisher`` the part or the links of
its description, a ``joint_state_publisher`` a stand-in for joint states; all others are processes.
"""

from __future__ import annotations

import math
import posixpath
import re
import shlex
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.param_files import matches
from tfcompose.compiler.resolve.presets import node_preset, node_preset_names
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.numbers import number
from tfcompose.foundation.reach import OutsideError
from tfcompose.foundation.yaml_text import Bare, parameter
from tfcompose.model.robot import BUILT_IN, value_of_word
from tfcompose.spec.load.params import Word, load_params
from tfcompose.tools.importers.static_transforms import (
    PROGRAM,
    ArgumentsRefusedError,
    reader_of,
    static_transform,
)
from tfcompose.tools.importers.texts import (
    MadeFile,
    Text,
    argument_of,
    concatenated,
    partition,
    parts_of,
)
from tfcompose.tools.importers.yaml_text import ExpressionText

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.files import Target
    from tfcompose.spec.load.params import NodeParams
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.static_transforms import Reader

STATE_PUBLISHER = "robot_state_publisher"
JOINT_PUBLISHERS = frozenset({"joint_state_publisher", "joint_state_publisher_gui"})
_FROM_TOPIC = (
    "nothing, if the node takes the description from the topic robot_description, where tfcompose"
    " publishes it"
)
#: The package of the stock containers of components.
CONTAINERS = "rclcpp_components"
#: A component's package and class, which YAML needs no quotes for.
_PLUGIN = re.compile(r"[A-Za-z]\w*/[A-Za-z_]\w*(::\w+)*", re.ASCII)
_NODE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
#: Between the words of a class's name.
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
#: Of a parameter file.
_MOST_BYTES = 16_000_000
#: How often joint_state_publisher sends, unless it is told.
_JOINTS_HZ = 10.0
#: As what a path begins whose package is not found.
PACKAGE = "package://"
#: Words that stand before a program and leave it what it is.
BEFORE = frozenset({"exec", "nohup", "time", "stdbuf", "setsid"})
_TF = ("/tf", "/tf_static")
#: What of the environment is a setting of all processes.
_SETTINGS = {"ROS_DOMAIN_ID": "domain_id", "ROS_AUTOMATIC_DISCOVERY_RANGE": "discovery"}


@dataclass(frozen=True, slots=True)
class Description:
    """What a robot_state_publisher is given.

    A xacro ``file`` with ``args``, or the text of a URDF.

    ``prefix`` is written in front of its frames.
    """

    file: str = ""
    args: Mapping[str, str] = field(default_factory=dict)
    text: str = ""
    prefix: str = ""
    at: Span | None = None


@dataclass(frozen=True, slots=True)
class Program:
    """A program as the source starts it.

    ``argv`` are its own arguments, or the whole command without a package; ``shell`` says that it
    is one text for a shell. ``params`` are parameters, and names of files, in order: the last one
    counts. ``namespace`` is absolute, or None where nothing is said. ``keys`` are further keys of
    the process, as in a robot file; ``period_s`` is how long after the launch it is started.
    ``todo`` is what of it could not be taken. It is a container of components if it ``loads``
    them, and a component where it has a ``plugin``, its class. ``exact`` are the indices of
    parameters that are given under the node's full name, others are given to every node.
    """

    at: Span | None
    package: str | None = None
    executable: str | None = None
    argv: tuple[str, ...] = ()
    shell: bool = False
    name: str | None = None
    label: str | None = None
    namespace: str | None = None
    params: tuple[Mapping[str, Any] | str, ...] = ()
    remap: tuple[tuple[str, str], ...] = ()
    env: Mapping[str, str] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)
    period_s: float = 0.0
    reader: Reader | None = None
    description: Description | None = None
    todo: tuple[str, ...] = ()
    loads: bool = False
    plugin: str = ""
    exact: range = range(0)


def add_program(draft: ImportDraft, program: Program, target: Target) -> str | None:
    """Add a program to the draft; return the name of its process, or None where it is none.

    A robot_state_publisher is not added here: its description makes links or a part, which
    ``descriptions`` does.
    """
    program = _split(program)
    if program.executable == PROGRAM:
        _add_transform(draft, program)
        return None
    if program.executable in JOINT_PUBLISHERS:
        return _add_joint_publisher(draft, program)
    return _add_process(draft, program, target)


def one_clock(draft: ImportDraft) -> None:
    """Set the robot's clock from node parameters or their argument, if all agree."""
    several = [process["params"] for process in draft.started().values() if "params" in process]
    clocks = [params["use_sim_time"] for params in several if "use_sim_time" in params]
    arguments = {argument_of(clock) for clock in clocks}
    if clocks and all(clock is True for clock in clocks):
        draft.sections["ros"]["clock"] = "sim"
        for process in draft.started().values():
            if process.get("params", {}).pop("use_sim_time", None) and not process["params"]:
                del process["params"]
    elif len(arguments) == 1 and (argument := arguments.pop()):
        draft.sections["ros"]["clock"] = ExpressionText(
            f"'sim' if args.{argument.name} else 'wall'"
        )


def is_setting(draft: ImportDraft, name: str, value: str) -> bool:
    """Return whether a variable is a setting of the whole robot, which then has it.

    The first value counts.
    """
    if name not in _SETTINGS:
        return False
    known = {"domain_id": int(value) if value.isdecimal() else None, "discovery": value.lower()}
    wanted = known[_SETTINGS[name]]
    allowed = (
        wanted in {"localhost", "subnet", "off"} if name != "ROS_DOMAIN_ID" else wanted is not None
    )
    return allowed and draft.sections["ros"].setdefault(_SETTINGS[name], wanted) == wanted


def path_from(target: Target, path: str) -> str:
    """Return a path as the robot file has it.

    From its folder, or absolute where they have but the root in common.
    """
    begin = posixpath.normpath(posixpath.join(target.top, target.folder))
    is_near = posixpath.commonpath([begin, posixpath.join(target.top, path)]) != "/"
    return (
        target.from_folder(path)
        if is_near
        else posixpath.normpath(posixpath.join(target.top, path))
    )


def where(at: Span | None, what: str = "") -> str:
    """Return the place of a value as a comment has it."""
    place = f"{posixpath.basename(at.file)}:{at.line}" if at and at.file else ""
    return ": ".join(word for word in (place, what) if word)


def _split(program: Program) -> Program:
    """Return the program with what it is a command line of, and with its ROS arguments as keys."""
    if program.shell:
        program = _without_shell(program)
    if program.package is None and not program.shell:
        program = _of_command(program)
    return _without_ros_arguments(program) if program.package is not None else program


#: What a shell does more with than take it as a part of a word.
_OF_SHELLS = re.compile(r"[$`|&;<>(){}*?~#\[\]!\n]|^\s*\w+=")


def _without_shell(program: Program) -> Program:
    """Return what a shell would start, where it does nothing but split the text into words.

    The arguments of a package's program are split so too, and what more a shell does with them is
    left out with a word.
    """
    text = concatenated(program.argv, " ")
    is_known = all(isinstance(part, str) for part in parts_of(text))
    does_more = not is_known or bool(_OF_SHELLS.search(text))
    words = program.argv
    try:
        words = tuple(shlex.split(text)) if is_known else words
    except ValueError:
        does_more = True
    if program.package is not None:
        todo = (f"what a shell makes of {text}",) if does_more else ()
        return replace(program, argv=words, shell=False, todo=(*program.todo, *todo))
    if not does_more:
        plain = replace(program, argv=words, shell=False)
        return plain if _of_command(plain).package else program
    if PROGRAM in text:
        return replace(program, todo=(*program.todo, f"the edge of the {PROGRAM} in it"))
    return program


def _of_command(program: Program) -> Program:
    """Return the package's program that a command starts, if it starts one."""
    words = list(program.argv)
    while words and words[0] in BEFORE:
        words.pop(0)
    match words:
        case ["ros2", "run", package, executable, *rest] if not package.startswith("-"):
            reader: Reader | None = "ros2"
        case ["rosrun", package, executable, *rest] if not package.startswith("-"):
            reader = "tf" if package == "tf" else "tf2_ros"
        case [path, *rest] if posixpath.basename(path) == PROGRAM:
            package, executable, reader = "tf2_ros", PROGRAM, None
        case _:
            return program
    return replace(
        program,
        package=package,
        executable=executable,
        argv=tuple(rest),
        reader=program.reader or reader,
    )


def _without_ros_arguments(program: Program) -> Program:
    """Return the program with what ``--ros-args`` says as its keys.

    What has no key stays an argument.
    """
    own: list[str] = []
    kept: list[str] = []
    params, remap = list(program.params), list(program.remap)
    found: dict[str, Any] = {"name": program.name, "namespace": program.namespace}
    keys = dict(program.keys)
    inside = False
    words = iter(program.argv)
    for word in words:
        if not inside or word in {"--ros-args", "--"}:
            inside = word == "--ros-args" if word in {"--ros-args", "--"} else inside
            if not inside and word != "--ros-args":
                own.append(word)
            continue
        value = next(words, "") if word in _WITH_VALUE else ""
        left, _, right = partition(value, ":=")
        if word in {"-r", "--remap"} and right:
            rule = {"__node": "name", "__name": "name", "__ns": "namespace"}.get(left)
            found |= {rule: right} if rule else {}
            remap += [] if rule else [(left, right)]
        elif word in {"-p", "--param"} and right and is_finite(typed := _yaml_value(right)):
            params.append({left: typed})
        elif word == "--params-file":
            params.append(value)
        elif word == "--log-level" and value in _LEVELS:
            keys["log_level"] = value
        else:
            kept += [word, value] if value else [word]
    argv = (*own, "--ros-args", *kept) if kept else tuple(own)
    namespace, name = found["namespace"], found["name"]
    return replace(
        program,
        argv=argv,
        params=tuple(params),
        remap=tuple(remap),
        name=name,
        namespace=namespace,
        keys=keys,
    )


_WITH_VALUE = frozenset(
    {"-r", "--remap", "-p", "--param", "--params-file", "--log-level", "-e", "--enclave"}
)
_LEVELS = frozenset({"debug", "info", "warn", "error", "fatal"})


def is_finite(value: Any) -> bool:
    """Return whether no number of a parameter is infinite or none: a robot file has no such."""
    several = value if isinstance(value, list) else [value]
    return all(math.isfinite(one) for one in several if isinstance(one, float))


def _yaml_value(text: str) -> Any:
    """Return a parameter of the command line, which ROS reads as one of a parameter file."""
    if isinstance(text, Text):
        return text
    try:
        (section,) = load_params(f"n:\n  ros__parameters:\n    value: {text}\n", "").nodes
    except (RejectedError, ValueError):
        return text
    value = section.params.get("value", text)
    return text if isinstance(value, dict) else _value_in(value)


def _add_transform(draft: ImportDraft, program: Program) -> None:
    at = program.at
    moved = dict(program.remap)
    reader = program.reader or reader_of(program.argv)
    try:
        transform = static_transform(program.argv, reader)
    except ArgumentsRefusedError as error:
        draft.todo(
            f"{PROGRAM} {' '.join(program.argv)}: {error}", at, advice="write the frame by hand"
        )
        return
    notes = [where(at, transform.order)]
    added = draft.frame(transform.parent, transform.child, transform.keys(), at, *notes)
    entry = ("frames", transform.child)
    if added and not isolated(draft, moved, program.namespace):
        several = ", ".join(f"{old} → {new}" for old, new in moved.items())
        draft.todo(
            f"the publisher is remapped: {several}",
            at,
            entry,
            advice="ros: {namespace: …, isolate: topics}",
        )
    for one in program.todo:
        draft.todo(one, at, entry)


def isolated(draft: ImportDraft, moved: Mapping[str, str], namespace: str | None) -> bool:
    """Return whether remappings keep TF, or move it below the draft's namespace."""
    new = {topic: moved[topic] for topic in _TF if moved.get(topic, topic) != topic}
    if any(name != topic.strip("/") for topic, name in new.items()):
        return False
    space = (namespace or "").strip("/")
    if not new or not space:
        return True
    if draft.sections["ros"].setdefault("namespace", space) != space:
        return False
    draft.sections["ros"]["isolate"] = "topics"
    return True


def one_namespace(draft: ImportDraft) -> None:
    """Give namespaces as the robot's has them below it, and absolute where they are elsewhere."""
    ros = draft.sections["ros"]
    space = ros.get("namespace")
    if not space:
        return
    for name, keys in draft.started().items():
        if name in BUILT_IN:
            continue
        own = keys.pop("namespace", "")
        if own.startswith(f"{space}/"):
            keys["namespace"] = own[len(space) + 1 :]
        elif own != space:
            keys["namespace"] = concatenated(["/", own])
            if ros.get("isolate"):
                message = f"{name} is not in {space}: its /tf is the robot's, {space}/tf"
                draft.todo(message, None, draft.entry_of(name), SEVERAL)


#: What several robots are in a robot file.
SEVERAL = "several robots are parts, each with its namespace, or a fleet: import each on its own"


def _add_joint_publisher(draft: ImportDraft, program: Program) -> str:
    """Add a stand-in for joint states.

    All joints at 0, as joint_state_publisher has them unless it is told.
    """
    params: dict[str, Any] = {}
    for one in program.params:
        params |= one if isinstance(one, dict) else {}
    zeros = {
        name.partition(".")[2]: value
        for name, value in params.items()
        if name.startswith("zeros.")
    }
    rate = params.get("rate", _JOINTS_HZ)
    rate = (
        float(rate)
        if isinstance(rate, (int, float)) and not isinstance(rate, bool)
        else _JOINTS_HZ
    )
    simulate: dict[str, Any] = {"joints": zeros or "zero", "rate": _hertz(rate)}
    notes = [where(program.at, f"in the place of {program.executable}")]
    name = draft.process(
        program.name or program.executable or "joints", {"simulate": simulate}, *notes
    )
    entry = ("processes", name)
    if str(program.executable).endswith("_gui"):
        draft.note(entry, "it has no sliders: tfcompose view has")
    left = [
        key
        for key in params
        if key != "rate" and not key.startswith("zeros.") and key != "use_sim_time"
    ]
    for key in left:
        draft.todo(f"{program.executable}: the parameter {key}", program.at, entry)
    for one in (
        *program.todo,
        *(f"parameters of {file}" for file in program.params if isinstance(file, str)),
    ):
        draft.todo(one, program.at, entry)
    return name


def _hertz(value: float) -> Any:
    return f"{number(value)} Hz"


def _add_process(draft: ImportDraft, program: Program, target: Target) -> str:
    at, todo, advice = program.at, list(program.todo), ""
    program = replace(program, argv=tuple(_with_made(word, draft) for word in program.argv))
    source_name = program.name
    if not program.name and program.package and (name := _named_in_files(program.params, draft)):
        program = replace(program, name=name)
    usual = (
        _usual_name(program.package)
        if program.package and not program.name and not program.plugin
        else None
    )
    wanted = (
        (program.name and program.label)
        or program.name
        or usual
        or program.label
        or _plain(program)
        or "process"
    )
    name = draft.free_name(wanted)
    keys = _way(program)
    notes = [where(at)]
    if not source_name and _keeps_its_name(program, keys):
        keys["nodes"] = {program.name or usual or name: {}}
        if not program.name and not usual:
            notes.append(f"the source does not name the node: {name} is a guess")
    elif program.name and program.name != name:
        keys["node"] = program.name
    if program.namespace and program.namespace.strip("/"):
        keys["namespace"] = program.namespace.strip("/")
    keeps_name = "nodes" in keys
    params, own, left = _params(
        program, target, program.name or name, draft, keeps_name=keeps_name
    )
    keys |= {"nodes": {node: {"params": own} for node in keys["nodes"]}} if own else {}
    keys |= {"params": params} if params else {}
    keys |= {"remap": remappings(program.remap)} if program.remap else {}
    keys |= {"env": dict(program.env)} if program.env else {}
    keys |= dict(program.keys)
    section = "containers" if program.loads else "processes"
    draft.process(name, keys, *(note for note in notes if note), section=section)
    for word in _texts((*program.argv, *program.env.values())):
        if PACKAGE in word and not _is_literal(word, at, draft):
            todo.append(f"{word} is in a package that is not found here: write its path")
            advice = "--package NAME=FOLDER, or source the workspace's setup file"
    for one in (*todo, *left):
        draft.todo(one, at, (section, name), advice)
    if program.description is not None:
        draft.todo("the parameter robot_description", at, (section, name), _FROM_TOPIC)
    return name


def _is_literal(word: str, at: Span | None, draft: ImportDraft) -> bool:
    """Whether the source has the word's addresses of packages itself, as the program reads them.

    What the source looks up in a package that is not found has such an address too.
    """
    try:
        source = draft.reach.read(at.file, _MOST_BYTES) if at else b""
    except (OutsideError, OSError):
        return False
    return all(address.encode() in source for address in re.findall(rf"{PACKAGE}\w+", word))


def _with_made(word: str, draft: ImportDraft) -> str:
    """Return a word of a command line, with the path of a file that the source makes as ours."""
    made = next((path for path in draft.made if word.endswith(path)), None)
    if made is None:
        return word
    return Text.of((word.removesuffix(made), MadeFile(draft.bring(made))))


def _keeps_its_name(program: Program, keys: Mapping[str, Any]) -> bool:
    """Whether a program without a name is nodes of their own names.

    A name on its command line would rename them all.
    """
    is_node = program.package is not None and "launch" not in keys.get("run", ())
    return is_node and not program.plugin and not program.loads


def remappings(rules: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return remappings as a robot file has them.

    ROS takes the first of several rules for one name.
    """
    return dict(reversed(list(dict(reversed(rules)).items())))


def _way(program: Program) -> dict[str, Any]:
    """Return the keys that say how the program runs."""
    if program.plugin:
        name = f"{program.package}/{program.plugin}"
        return {"component": Bare(name) if _PLUGIN.fullmatch(name) else name, "container": ""}
    if program.loads:
        return _container_keys(program)
    return {"run": _run(program)} | ({"shell": True} if program.shell else {})


#: Containers of rclcpp_components, with the keys that name them.
_CONTAINERS: dict[str, dict[str, Any]] = {
    "component_container": {},
    "component_container_mt": {"executor": "multi"},
    "component_container_isolated": {"isolation": "isolated"},
}
_MULTI = "--use_multi_threaded_executor"


def _container_keys(program: Program) -> dict[str, Any]:
    """Return what a container is.

    By its isolation and executor if it is a stock one, else by its program.
    """
    words = list(program.argv)
    stock = _CONTAINERS.get(program.executable or "") if program.package == CONTAINERS else None
    if stock is None:
        keys: dict[str, Any] = (
            {"package": program.package} if program.package != CONTAINERS else {}
        )
        return keys | {"executable": program.executable} | ({"args": words} if words else {})
    keys = dict(stock)
    if keys.get("isolation") and _MULTI in words:
        words.remove(_MULTI)
        keys["executor"] = "multi"
    return keys | ({"args": words} if words else {})


def _named_in_files(params: Sequence[Mapping[str, Any] | str], draft: ImportDraft) -> str | None:
    """Return the node that parameter files are written for, where that is one alone.

    None where none is named.
    """
    files = [file for file in params if isinstance(file, str)]
    nodes = [node.name for file in files for node in _nodes_in(file, draft) or ()]
    names = {node.rpartition("/")[2] for node in nodes if "*" not in node}
    name = names.pop() if len(names) == 1 else ""
    return name if _NODE.fullmatch(name) else None


def _usual_name(package: str) -> str | None:
    """Return how the node of a package calls itself, where that is known."""
    names = {
        preset.node
        for one in node_preset_names()
        if (preset := node_preset(one)).package == package
    }
    return names.pop() if len(names) == 1 else None


def _texts(words: Sequence[Any]) -> list[str]:
    return [word for word in words if isinstance(word, str)]


def _run(program: Program) -> Any:
    """Return what ``run`` says of the program."""
    if program.shell:
        return concatenated(program.argv, " ")
    if program.package is not None:
        run: dict[str, Any] = {"package": program.package, "executable": program.executable}
        return run | ({"args": list(program.argv)} if program.argv else {})
    match program.argv:
        case ("ros2", "launch", package, file, *words) if (
            all(":=" in word for word in words)
            and ":=" not in file
            and not package.startswith("-")
        ):
            run = {"launch": f"{package}/{file}"}
            args = {left: right for left, _, right in (partition(word, ":=") for word in words)}
            return run | ({"args": args} if args else {})
    return list(program.argv)


def _plain(program: Program) -> str:
    """Return the name of what is started, without its folder and ending."""
    match program.argv:
        case ("ros2", "launch", _, file, *_) if program.package is None:
            word = file
        case ("ros2", verb, *_) if program.package is None:
            word = f"ros2_{verb}"
        case _ if program.plugin:
            return _CAMEL.sub("_", program.plugin.rpartition("::")[2]).lower()
        case _:
            word = program.executable or (
                next(iter(program.argv[0].split()), "") if program.argv else ""
            )
    plain = posixpath.basename(word).partition(".")[0]
    script = next((one for one in program.argv[1:] if one.endswith(".py")), "")
    return (
        posixpath.basename(script).removesuffix(".py")
        if script and plain.startswith("python")
        else plain
    )


def _params(
    program: Program, target: Target, node: str, draft: ImportDraft, *, keeps_name: bool
) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
    """Return the parameters as a robot file has them, files first, its node's own, and the rest.

    rcl keeps sections in the order in which their names come first, and of several for a node the
    last one counts; launch itself gives a component one after the other. A robot file's own
    parameters count before those of its files: it has those that its files alone do not give.
    Where a node ``keeps_name``, they are for every node of the process, and its own beside them.
    """
    files: list[str] = []
    left = []
    full = f"{(program.namespace or '').rstrip('/')}/{node}"
    sections: dict[tuple[str, int], dict[str, Any]] = {}
    of_files: dict[tuple[str, int], dict[str, Any]] = {}
    for index, one in enumerate(program.params):
        if not isinstance(one, str):
            given = [(full if index in program.exact else _ANY, dict(one))]
        elif one.startswith(PACKAGE):
            left.append(f"the parameters of {one}: the package is not found here")
            continue
        else:
            files.append(draft.bring(one) if one in draft.made else path_from(target, one))
            nodes = _nodes_in(one, draft)
            if nodes is None and any(sections.values()):
                left.append(
                    f"{one} is laid over the parameters before it: here they are laid over the"
                    " file"
                )
            given = [(each.name, dict(_by_full_name(each.params, ""))) for each in nodes or ()]
            for name, params in given:
                of_files.setdefault((name, 0), {}).update(params)
        for name, params in given:
            sections.setdefault((name, index if program.plugin else 0), {}).update(params)
    common: dict[str, Any] = {}
    if keeps_name:
        in_file = of_files.setdefault((_ANY, 0), {})
        several = sections.get((_ANY, 0), {})
        common = {key: one for key, one in several.items() if one is not in_file.get(key)}
        in_file |= common
    found = _that_count(of_files, full)
    own = {
        key: one for key, one in _that_count(sections, full).items() if one is not found.get(key)
    }
    named: dict[str, Any] = {"file": files[0] if len(files) == 1 else files} if files else {}
    if keeps_name:
        return named | _values(common), _values(own), left
    return named | _values(own), {}, left


def _values(params: Mapping[str, Any]) -> dict[str, Any]:
    return {key: parameter(_value_in(value)) for key, value in params.items()}


#: The section of a parameter file that means every node.
_ANY = "/**"


def _that_count(sections: Mapping[tuple[str, int], dict[str, Any]], node: str) -> dict[str, Any]:
    """Return the parameters that a node has of sections, which are by their names in order."""
    several = (params for (name, _), params in sections.items() if matches(name, node))
    return {key: value for params in several for key, value in params.items()}


def _value_in(value: Any) -> Any:
    """Return a parameter's value, also where it is words of a file."""
    if isinstance(value, list):
        return list(map(_value_in, value))
    if isinstance(value, Word):
        return value_of_word(value.text) if value.plain else value.text
    return value


def _by_full_name(params: Mapping[str, Any], above: str) -> Iterator[tuple[str, Any]]:
    for key, value in params.items():
        if isinstance(value, dict):
            yield from _by_full_name(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _nodes_in(file: str, draft: ImportDraft) -> list[NodeParams] | None:
    """Return what a parameter file has for nodes, or None where it has nothing.

    None, too, if it is not there, or may not be read.
    """
    try:
        text = draft.made.get(file) or draft.reach.read(file, _MOST_BYTES).decode()
        return load_params(text, file).nodes or None
    except (OSError, OutsideError, UnicodeDecodeError, RejectedError):
        return None
