"""Reads launch files in a confined process of its own: a launch file is a program.

It has no network, and cannot start programs, write files or signal others, and reads only what it
is told: the kernel refuses all else (``sandbox``), and a hook of Python's names what a launch file
tries of it. Modules that are not installed give values that do nothing, and are named too.
"""

from __future__ import annotations

import builtins
import errno
import functools
import importlib
import importlib.abc
import importlib.machinery
import io
import os
import re
import subprocess
import sys
import tempfile
import types
import warnings
from pathlib import Path
from typing import Any

import yaml

from tfcompose.foundation.sandbox import Channel, Readable, confine, limit, take_spare_memory
from tfcompose.tools.importers import launch_actions as actions
from tfcompose.tools.importers import launch_conditions as conditions
from tfcompose.tools.importers import launch_substitutions as substitutions
from tfcompose.tools.importers import launch_texts as texts
from tfcompose.tools.importers.launch_moveit import MoveItConfigsBuilder
from tfcompose.tools.importers.launch_substitutions import (
    PACKAGE,
    Context,
    FailedError,
    Missing,
    place,
)

MOST_RECORDS = 20_000
#: The function of a Python launch file.
_MAKE = "generate_launch_description"
_HIGHEST = 12
_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")

#: What a launch file is not let do, by the names of Python's audit events.
_REFUSED = frozenset(
    {
        "os.system",
        "os.exec",
        "os.fork",
        "os.forkpty",
        "os.posix_spawn",
        "os.spawn",
        "os.startfile",
        "pty.spawn",
        "subprocess.Popen",
        "socket.connect",
        "socket.bind",
        "socket.sendto",
        "socket.sendmsg",
        "socket.getaddrinfo",
        "socket.gethostbyname",
        "socket.gethostbyaddr",
        "os.remove",
        "os.rename",
        "os.rmdir",
        "os.mkdir",
        "os.link",
        "os.symlink",
        "os.truncate",
        "os.chmod",
        "os.chown",
        "os.kill",
        "os.killpg",
        "shutil.rmtree",
        "shutil.move",
        "shutil.copyfile",
        "shutil.copytree",
        "socket.__new__",
        "ctypes.dlopen",
        "ctypes.dlsym",
        "ctypes.dlsym/handle",
        "ctypes.call_function",
        "ctypes.cdata",
        "ctypes.cdata/buffer",
        "ctypes.string_at",
        "ctypes.addressof",
    }
)
#: What reads a path.
_READS = frozenset({"open", "os.listdir", "os.scandir"})
#: Packages of ROS's that the stand-in is in the place of, and what xacro and the ament index are.
_LAUNCH = frozenset(
    {
        "launch",
        "launch_ros",
        "launch_xml",
        "launch_yaml",
        "nav2_common",
        "ament_index_python",
        "xacro",
        "lifecycle_msgs",
        "launch_param_builder",
        "moveit_configs_utils",
        "launch_testing",
    }
)
#: Packages of which only programs are named, that are not run here.
_TOOLS = {"xacro"}
#: Those that are themselves where launch is installed.
_INSTALLED = frozenset({"launch", "launch_ros", "launch_xml", "launch_yaml", "lifecycle_msgs"})


class Reader:
    """Reads launch files into ``context``; ``recorder`` is set with ROS's launch."""

    def __init__(self, request: dict[str, Any]) -> None:
        self.packages: dict[str, str] = request["packages"]
        self.prefixes: list[str] = request["prefixes"]
        self.recorder = _recorder() if request["with_launch"] else None
        kind = self.recorder.RecordingContext if self.recorder else Context
        self.context: Context = kind(self.find, every_branch=request["every_branch"])
        self.context.configurations |= request["arguments"]
        self.replaced = _LAUNCH - _INSTALLED if self.recorder else _LAUNCH
        self.missed: set[str] = set()
        self._known: dict[str, str | None] = {}

    def find(self, name: str, file: str) -> str | None:
        """Return the folder of a package.

        A named or an installed one, or one around the launch file.
        """
        key = f"{name} {Path(file).parent}"
        if key not in self._known:
            self._known[key] = self._find(name, file)
            if self._known[key] is None and name not in self.missed | _TOOLS:
                self.missed.add(name)
                at = place()
                self.context.record("package", at if at[0] else self.context.at, name=name)
        return self._known[key]

    def _find(self, name: str, file: str) -> str | None:
        for known in [
            self.packages.get(name),
            *(f"{prefix}/share/{name}" for prefix in self.prefixes),
        ]:
            if known and Path(known).is_dir():
                return str(Path(known).absolute())
        for above in list(Path(file).absolute().parents)[:_HIGHEST]:
            for folder in (above, above / name):
                manifest = folder / "package.xml"
                found = (
                    _NAME.search(manifest.read_text("utf-8", "replace"))
                    if manifest.is_file()
                    else None
                )
                if found and found[1] == name:
                    return str(folder)
        return None

    def share(self, name: str, **_more: Any) -> str:
        """Return the folder of a package, or what stands for it."""
        return self.find(name, self.context.file) or f"{PACKAGE}{name}"

    def load(self, path: str, context: Context) -> Any:
        """Return the launch description of a file.

        Raises:
            FailedError: if it has none.
        """
        text, kind = texts.read(path)
        if kind != "py" and self.recorder:
            return self.recorder.parsed_text(path)
        if kind != "py":
            return texts.Actions(
                texts.of_xml(text, path) if kind == "xml" else texts.of_yaml(text, path)
            )
        module: dict[str, Any] = {
            "__file__": path,
            "__name__": f"{substitutions.MODULE}{len(context.records)}",
        }
        try:
            exec(compile(text, path, "exec"), module)  # noqa: S102 (that is what this process is for)
            if _MAKE in module:
                return module[_MAKE]()
        except (FailedError, MemoryError):
            raise
        except SyntaxError as error:
            raise FailedError(error.msg, error.lineno or 0) from None
        except BaseException as error:  # noqa: BLE001 (any can come out of it)
            raise FailedError(
                f"it stopped: {type(error).__name__}: {error}", _line(error, path)
            ) from None
        raise FailedError(f"it has no function {_MAKE}")


def _line(error: BaseException, path: str) -> int:
    """Return the line of the file at which it was stopped, 0 where it was in none of its own."""
    trace, line = error.__traceback__, 0
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == path else line
        trace = trace.tb_next
    return line


def _recorder() -> Any:
    """Return the recorder for ROS's launch, which is attached to it.

    Raises:
        FailedError: if launch cannot be imported.
    """
    warnings.simplefilter("ignore")  # launch's advice is for whoever writes launch files
    try:
        recorder = importlib.import_module("tfcompose.tools.importers.launch_recorder")
        recorder.attach()
    except Exception as error:  # noqa: BLE001 (a broken installation raises what it likes)
        raise FailedError(f"{type(error).__name__}: {error}") from None
    return recorder


# What launch files import


class _Module(types.ModuleType):
    """A module of launch: each of its names is one of the stand-in, or is not known here."""

    __path__: list[str] = []  # noqa: RUF012 (as a package has it)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        found = _known(self.__name__, name)
        if found is None and self.__name__ in _WITH_MODULES and name in _MODULES:
            found = importlib.import_module(f"{self.__name__}.{name}")
        if found is None:
            qualified = f"{self.__name__}.{name}"
            found = (
                type(name, (actions.Unknown,), {"NAME": qualified})
                if name[:1].isupper()
                else Missing(qualified)
            )
        setattr(self, name, found)
        return found


#: Packages that import their modules by themselves, and these: ``import launch`` gives
#: ``launch.actions`` too.
_WITH_MODULES = frozenset({"launch", "launch_ros"})
_MODULES = frozenset(
    {
        "actions",
        "conditions",
        "descriptions",
        "event_handlers",
        "events",
        "launch_description_sources",
        "parameter_descriptions",
        "some_substitutions_type",
        "substitutions",
        "utilities",
    }
)
_ALIASES = {
    "PushROSNamespace": "PushRosNamespace",
    "SetROSRemap": "SetRemap",
    "PathJoin": "PathJoinSubstitution",
    "PythonLaunchDescriptionSource": "LaunchDescriptionSource",
    "AnyLaunchDescriptionSource": "LaunchDescriptionSource",
    "XMLLaunchDescriptionSource": "LaunchDescriptionSource",
    "YAMLLaunchDescriptionSource": "LaunchDescriptionSource",
    "FrontendLaunchDescriptionSource": "LaunchDescriptionSource",
    "FindPackage": "FindPackageShare",
    "RosTimer": "TimerAction",
    "LaunchContext": "Context",
}
_CLASSES = {
    name: one
    for name, one in {**vars(substitutions), **vars(conditions), **vars(actions)}.items()
    if isinstance(one, type) and name[:1].isupper()
}


def _known(module: str, name: str) -> Any:
    if module == "launch.events" and name == "Shutdown":
        return actions.ShutdownEvent
    if module.startswith("launch.events") and name == "matches_action":
        return actions.matches_action
    if module.startswith("lifecycle_msgs"):
        return _Transition if name == "Transition" else None
    functions = {
        "perform_substitutions": lambda context, several: substitutions.text_of(several, context),
        "normalize_to_list_of_substitutions": lambda value: (
            value if isinstance(value, list) else [value]
        ),
        "evaluate_condition_expression": conditions.evaluate_condition_expression,
        "matches_action": actions.matches_action,
    }
    return _CLASSES.get(_ALIASES.get(name, name)) or functions.get(name)


class _Transition:
    TRANSITION_CONFIGURE, TRANSITION_ACTIVATE = 1, 3


class _Rewritten(substitutions.Substitution):
    """nav2_common's RewrittenYaml and ReplaceString.

    The file as it is, and what would be changed in it.
    """

    def perform(self, context: Context) -> str:
        file = substitutions.with_package(
            substitutions.text_of(self.kwargs.get("source_file", ""), context)
        )
        changes = self.kwargs.get("param_rewrites") or self.kwargs.get("replacements") or {}
        items = changes.items() if isinstance(changes, dict) else ()
        several = ", ".join(
            f"{substitutions.text_of(key, context)}: {substitutions.text_of(value, context)}"
            for key, value in items
        )
        root = substitutions.text_of(self.kwargs.get("root_key") or "", context).strip("/")
        several = ", ".join(
            one for one in (f"all is put below {root}" if root else "", several) if one
        )
        if several:
            context.todo(self.at, f"changes in {Path(file).name}: {several}")
        return file


class _RobotPoses:
    """nav2_common's ParseMultiRobotPose.

    Poses of robots, which it takes from the command line of ``ros2 launch``.
    """

    def __init__(self, context: Context, argument: str) -> None:
        context.todo(
            place(),
            f"the argument {argument}, which ParseMultiRobotPose takes from the command line",
        )

    def value(self) -> dict[str, Any]:
        """Return no robots."""
        return {}


class _HasNode(substitutions.Substitution):
    """nav2_common's HasNodeParams: whether a parameter file has a node."""

    def perform(self, context: Context) -> str:
        file = substitutions.text_of(self.kwargs.get("source_file", ""), context)
        node = substitutions.text_of(self.kwargs.get("node_name", ""), context)
        try:
            data = yaml.safe_load(Path(file).read_text("utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise FailedError(f"{file} cannot be read: {error}") from None
        return str(isinstance(data, dict) and node in data)


class _Document:
    """What xacro makes of a file."""

    def __init__(self, file: Any, mappings: Any = None) -> None:
        args = {str(name): str(value) for name, value in dict(mappings or {}).items()}
        self.text = substitutions.marked(file=substitutions.with_package(str(file)), args=args)

    def toxml(self, *_args: Any, **_kwargs: Any) -> str:
        return self.text

    toprettyxml = toxml


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds the stand-in's modules.

    At the end of all finders, also those that are not installed.
    """

    def __init__(self, reader: Reader, *, last: bool) -> None:
        self.reader, self.last = reader, last

    def find_spec(self, fullname: str, _path: Any = None, _target: Any = None) -> Any:
        top = fullname.partition(".")[0]
        mine = top in self.reader.replaced
        if mine is self.last or (self.last and not _is_from_launch_file()):
            return None
        return importlib.machinery.ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: Any) -> Any:
        module = _Module(spec.name)
        if self.last:
            self.reader.context.todo(place(), f"the module {spec.name} is not installed here")
        elif spec.name.startswith("ament_index_python"):
            _fill_index(module, self.reader)
        elif spec.name == "xacro":
            vars(module).update(
                process_file=_Document,
                process=lambda file, **more: _Document(file, **more).text,
                parse=_Document,
                process_doc=lambda *_a, **_k: None,
            )
        elif spec.name.startswith("nav2_common"):
            of = (
                self.reader.recorder.as_substitution if self.reader.recorder else lambda kind: kind
            )
            vars(module).update(
                RewrittenYaml=of(_Rewritten),
                ReplaceString=of(_Rewritten),
                HasNodeParams=of(_HasNode),
                LaunchConfigAsBool=of(substitutions.LaunchConfigAsBool),
                ParseMultiRobotPose=functools.partial(_RobotPoses, self.reader.context),
            )
        elif spec.name.startswith("moveit_configs_utils"):
            find, context = self.reader.share, self.reader.context
            vars(module)["MoveItConfigsBuilder"] = functools.partial(
                MoveItConfigsBuilder, find, context
            )
        return module

    def exec_module(self, module: Any) -> None:
        """Nothing has to be run."""


def _is_from_launch_file() -> bool:
    frame: Any = sys._getframe(2)  # noqa: SLF001 (CPython's only way)
    while frame is not None:
        name = frame.f_code.co_filename
        if not name.startswith("<frozen") and name != __file__ and "importlib" not in name:
            return str(frame.f_globals.get("__name__", "")).startswith(substitutions.MODULE)
        frame = frame.f_back
    return False


def _fill_index(module: types.ModuleType, reader: Reader) -> None:
    class PackageNotFoundError(KeyError):
        """The error of the real index, which is not raised here."""

    several = {
        "get_package_share_directory": reader.share,
        "get_package_prefix": reader.share,
        "get_package_share_path": lambda name, **_: Path(reader.share(name)),
        "get_packages_with_prefixes": dict,
        "PackageNotFoundError": PackageNotFoundError,
    }
    vars(module).update(several)


# Confinement


def _watch(  # noqa: C901 (one hook after another)
    context: Context, null: int, readable: Readable | None
) -> None:
    """Refuse and name what a launch file may not do; pass over what is often done and needless.

    With ``readable`` paths it may do nothing else but read these.
    """
    noted: set[str] = set()

    def note(what: str) -> None:
        if what not in noted:
            noted.add(what)
            context.todo(place(), f"{what}: not done")

    def audit(event: str, args: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+")
        flags = (
            event == "open"
            and isinstance(args[2], int)
            and args[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        )
        if event in _REFUSED or ((writes or flags) and not isinstance(args[0], int)):
            what = next(
                (
                    str(one)
                    for one in args
                    if isinstance(one, (str, bytes, os.PathLike, list, tuple))
                ),
                "",
            )
            note(f"{'open for writing' if event == 'open' else event} {what}".strip())
            raise PermissionError(f"{event} is not done while launch files are read")
        if event in _READS and not may_read(args[0]):
            note(f"{event} {os.fsdecode(args[0])}, which it may not read")
            raise PermissionError(errno.EACCES, "It may not be read", os.fsdecode(args[0]))

    def may_read(path: Any) -> bool:
        if isinstance(path, int) or path is None or readable is None:
            return True
        real = os.path.realpath(os.fsdecode(path))
        return any(
            real == root or real.startswith(f"{root.rstrip('/')}/")
            for root in (*readable.paths, *readable.listed)
        )

    def run(words: Any, *_args: Any, **more: Any) -> Any:
        argv = words.split() if isinstance(words, str) else list(map(str, words))
        try:
            output = substitutions.of_command(argv, " ".join(argv))
        except FailedError:
            note(f"the command {' '.join(argv)}")
            output = ""
        is_text = more.get("text") or more.get("universal_newlines") or more.get("encoding")
        return subprocess.CompletedProcess(argv, 0, output if is_text else output.encode(), "")

    def system(command: Any) -> int:
        note(f"os.system({command!r})")
        return 0

    def folder(path: Any, *_args: Any, **_more: Any) -> None:
        note(f"the folder {path} would be made")

    def temporary(suffix: str = "", prefix: str = "tmp", dir: Any = None) -> str:  # noqa: A002 (as it is called)
        count = len(made)
        made.append(f"{dir or tempfile.gettempdir()}/{prefix}{count}{suffix}")
        context.todo(
            place(), f"the temporary file {made[-1]}: its name is a new one at each launch"
        )
        return made[-1]

    made: list[str] = []

    def opened(file: Any, mode: str = "r", *args: Any, **more: Any) -> Any:
        path = (
            substitutions.with_package(os.fspath(file))
            if isinstance(file, (str, os.PathLike))
            else ""
        )
        if path == os.devnull:
            return plain_open(os.dup(null), mode, *args, **more)
        if str(path).startswith(PACKAGE):
            return io.StringIO(substitutions.file_text(str(path)))
        return plain_open(file, mode, *args, **more)

    def read_text(self: Path, *args: Any, **more: Any) -> str:
        path = substitutions.with_package(str(self))
        return (
            substitutions.file_text(path)
            if path.startswith(PACKAGE)
            else plain_read(self, *args, **more)
        )

    plain_open, plain_read = builtins.open, Path.read_text
    hooks: list[tuple[Any, str, Any]] = [
        (os, "system", system),
        (os, "makedirs", folder),
        (os, "mkdir", folder),
        (Path, "mkdir", folder),
        (subprocess, "run", run),
        (subprocess, "call", lambda *a, **k: run(*a, **k).returncode),
        (subprocess, "check_call", lambda *a, **k: run(*a, **k).returncode),
        (subprocess, "check_output", lambda *a, **k: run(*a, **k).stdout),
        (subprocess, "getoutput", lambda words, **k: run(words, text=True, **k).stdout),
        (os, "popen", lambda words, *_a, **_k: io.StringIO(run(words, text=True).stdout)),
        (builtins, "open", opened),
        (Path, "read_text", read_text),
        (tempfile, "mktemp", temporary),
    ]
    for owner, name, hook in hooks:
        setattr(owner, name, hook)
    if readable is not None:
        sys.addaudithook(audit)


def answer(request: dict[str, Any], null: int, readable: Readable | None) -> dict[str, Any]:
    """Return what came of reading a launch file.

    Records, in order, and why and at which line it stopped if it did.
    """
    try:
        reader = Reader(request)
    except FailedError as error:
        return {"records": [], "stopped": error.reason, "line": 0, "decided": []}
    context = reader.context
    actions.LOADERS[:] = [reader.load]
    sys.meta_path.insert(0, _Finder(reader, last=False))
    sys.meta_path.append(_Finder(reader, last=True))
    for name in [name for name in sys.modules if name.partition(".")[0] in reader.replaced]:
        del sys.modules[name]
    sys.dont_write_bytecode = True
    _watch(context, null, readable)
    stopped, line = "", 0
    context.file = request["file"]
    try:
        actions.visit_all([reader.load(request["file"], context)], context)
    except FailedError as error:
        stopped, line = error.reason, error.line
    except MemoryError:
        take_spare_memory()
        stopped = "it needs too much memory"
    except RecursionError:
        stopped = "it goes too deep"
    except BaseException as error:  # noqa: BLE001 (whatever a launch file raises is a finding)
        stopped = f"{type(error).__name__}: {error}"
    records = context.records
    decided = sorted(context.decided)
    return {
        "records": records[:MOST_RECORDS],
        "stopped": stopped,
        "line": line,
        "decided": decided,
    }


def main(reads: int, writes: int) -> None:
    """Serve one request."""
    channel = Channel(reads, writes)
    request = channel.receive()
    limit(request["wall_s"])
    tempfile.tempdir = request["temporary"]  # else Python would look for one by writing
    null = os.open(os.devnull, os.O_RDWR)  # no file can be opened for writing after this
    readable = Readable(*request["readable"]) if request["readable"] else None
    channel.send({"missing": confine(readable) if readable else []})
    answered = answer(request, null, readable)
    sys.stdout.flush()
    channel.send({"answer": answered})
    os._exit(0)
