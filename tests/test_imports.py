"""Who may import whom: the table of the architecture, read from the syntax trees, and what commands really load."""

import ast
import graphlib
import re
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.house import PACKAGE, ROOT, imports_of, part_of
from tests.support.tables import for_each

FOUNDATIONS = {"__init__", "catalogue", "findings", "geometry", "model", "plan"}
STAGES = {"load", "language", "resolve", "check"}

#: Which parts of the package each part may import, besides itself.
MAY_IMPORT: dict[str, set[str]] = {
    "__init__": set(),
    "catalogue": set(),
    "signals": set(),
    "findings": {"catalogue"},
    "geometry": set(),
    "numbers": {"geometry"},
    "tree": set(),
    "plan": {"findings", "geometry"},
    "ipc": {"findings", "plan"},
    "model": {"findings", "plan", "geometry", "tree", "units"},
    "files": {"model"},
    "load": {"findings", "text"},
    "render": {"catalogue", "draw", "findings", "geometry", "model", "numbers", "text", "tree"},
    "units": {"findings"},
    "language": {"catalogue", "findings", "geometry", "load", "model", "plan", "units"},
    "resolve": {
        "catalogue",
        "findings",
        "fleet",
        "geometry",
        "language",
        "load",
        "model",
        "plan",
        "text",
        "units",
        "urdf",
    },
    "meshes": {"geometry"},
    "rays": {"geometry", "meshes", "model"},
    "check": {"catalogue", "findings", "geometry", "load", "model", "rays", "text", "tree", "units"},
    "draw": {"text"},
    "urdf": {"catalogue", "check", "files", "findings", "geometry", "load", "meshes", "model", "numbers", "text"},
    "export": {"emit", "files", "numbers", "plan"},
    "emit": {"draw", "files", "geometry", "model", "numbers", "plan", "render", "urdf"},
    "text": set(),
    "ros": {"findings", "plan", "geometry", "signals"},
    "live": {"geometry", "plan", "ros", "signals", "tf2", "tree"},
    "bags": {"geometry", "live", "plan", "ros", "tf2"},
    "verdict": {"catalogue", "findings", "geometry", "live", "plan", "ros", "text", "tree"},
    "variables": set(),
    "fleet": {"findings", "geometry", "language", "load", "plan", "ros", "signals", "tf2"},
    "process": {"findings", "plan", "ros", "signals", "variables"},
    "guard": {
        "findings",
        "geometry",
        "ipc",
        "live",
        "plan",
        "process",
        "ros",
        "signals",
        "text",
        "variables",
        "verdict",
    },
    "launcher": {"findings", "ipc", "plan", "ros", "signals", "text", "variables"},
    "publishers": {"files", "geometry", "plan", "process", "ros", "signals", "text"},
    "tf2": {"geometry", "ros"},
    "compile": FOUNDATIONS | STAGES,
    "deploy": {"emit", "export", "files", "findings", "launcher", "model", "plan", "ros", "text"},
    "provenance": {"load", "model"},
    "pages": {"catalogue", "check"},
    "importing": {
        "compile",
        "files",
        "findings",
        "geometry",
        "language",
        "live",
        "load",
        "model",
        "numbers",
        "resolve",
        "text",
        "urdf",
    },
    "view": {
        "bags",
        "compile",
        "findings",
        "geometry",
        "language",
        "live",
        "load",
        "meshes",
        "model",
        "numbers",
        "plan",
        "provenance",
        "rays",
        "ros",
        "text",
        "tf2",
        "tree",
        "units",
        "urdf",
        "verdict",
    },
    "cli": {"*"},
    "__main__": {"cli"},
}

#: Packages from elsewhere, and the only parts that may import them.
ONLY_IN: dict[str, set[str]] = {
    "yaml": {"export", "importing", "load"},  # importing: launch reads parameters as YAML
    "launch_xml": {"importing"},
    "launch_yaml": {"importing"},
    "asyncssh": {"deploy"},
    "markdown_it": {"cli"},
    "pydantic": {"language"},
    "pydantic_core": {"language", "units"},
    "typing_extensions": {"language"},
    "numpy": {"publishers", "rays", "ros", "tf2", "urdf", "view"},  # rays and urdf: what trimesh gives are its arrays
    "xacro": {"urdf"},
    "trimesh": {"meshes", "rays", "view"},
    "viser": {"view"},
    "watchfiles": {"view"},
    "websockets": {"view"},
    "yourdfpy": {"urdf"},
    "pypdfium2": {"draw"},
    "regex": {"launcher"},
    "rich": {"cli"},
    "rclpy": {"ros"},
    "zenoh": {"fleet", "ros"},
    "xxhash": {"ros"},
    "rosbags": {"bags"},
    "tf2_msgs": {"ros"},
    "geometry_msgs": {"ros"},
    "sensor_msgs": {"ros"},
    "nav_msgs": {"ros"},
    "lifecycle_msgs": {"ros"},
    "composition_interfaces": {"ros"},
    "rcl_interfaces": {"ros"},
    "launch": {"importing", "launcher"},
    "launch_ros": {"importing", "launcher"},
    "std_msgs": {"ros"},
    "builtin_interfaces": {"ros"},
    "rosgraph_msgs": {"ros"},
    "diagnostic_msgs": {"guard"},
    "rosidl_generator_py": {"ros"},
    "rosidl_parser": {"ros"},
    "ament_index_python": {"ros"},
}


FILES = sorted(PACKAGE.rglob("*.py"))


def test_every_part_of_the_package_is_in_the_table() -> None:
    assert {part_of(file) for file in FILES} == set(MAY_IMPORT)


ROOMS = sorted(file for file in PACKAGE.glob("*/__init__.py"))


@for_each(ROOMS)
def test_a_room_says_what_it_is_for_and_what_it_must_not_import(file: Path) -> None:
    """The sentence that begins with "Must not import" names parts and packages that the tables do not allow."""
    part, docstring = part_of(file), ast.get_docstring(ast.parse(file.read_text("utf-8"))) or ""
    if part == "cli":
        return
    _, says, rest = docstring.partition("Must not import")
    assert says, part
    names = re.findall(r"``(\w+)``", re.split(r"[:.]", rest)[0])
    assert len(names) >= 3, part
    allowed = MAY_IMPORT[part] | {name for name, parts in ONLY_IN.items() if part in parts}
    assert not set(names) & allowed, part
    assert set(names) <= MAY_IMPORT.keys() | ONLY_IN.keys(), part


@for_each(FILES)
def test_a_file_imports_only_what_its_part_may(file: Path) -> None:
    part, allowed = part_of(file), MAY_IMPORT[part_of(file)]
    for name in imports_of(file):
        first, _, rest = name.partition(".")
        if first == "tfcompose":
            other = rest.partition(".")[0] or "__init__"
            assert other in {part, "__init__", *allowed} or "*" in allowed, f"{part} imports {name}"
    for name in imports_of(file, for_types=False):
        first = name.partition(".")[0]
        if first not in {*sys.stdlib_module_names, "tfcompose"}:
            assert part in ONLY_IN.get(first, set()), f"{part} imports {name}"


@for_each(FILES)
def test_a_stage_is_imported_by_its_own_name_from_outside(file: Path) -> None:
    """What a stage keeps in its files is its own: outside, ``from tfcompose.check import check``."""
    if part_of(file) in {*STAGES, "cli", "importing"}:
        return
    for name in imports_of(file):
        steps = name.split(".")
        assert not (len(steps) > 2 and steps[0] == "tfcompose" and steps[1] in STAGES), name


def test_launcher_guard_and_publishers_do_not_know_each_other() -> None:
    """They are processes of their own: what they tell each other stands in ``ipc``."""
    rooms = ("tfcompose.launcher", "tfcompose.guard", "tfcompose.publishers")
    for room in rooms:
        files = list((PACKAGE.parent / room.replace(".", "/")).rglob("*.py"))
        assert files
        for file in files:
            others = [other for other in rooms if other != room]
            assert not [name for name in imports_of(file) if name.startswith(tuple(others))], file


def test_a_command_is_imported_by_the_parser_alone() -> None:
    """What several commands share stands in ``cli`` itself."""
    importers = [
        file.relative_to(PACKAGE).as_posix()
        for file in FILES
        if any(name.startswith("tfcompose.cli.commands") for name in imports_of(file))
    ]
    assert importers == ["cli/parser.py"]


def test_no_module_imports_itself_by_way_of_others_not_even_for_its_types() -> None:
    modules = {".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file for file in FILES}
    graph: dict[str, set[str]] = {}
    for module, file in modules.items():
        tree = ast.parse(file.read_text("utf-8"))
        names = {
            name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.module
            for name in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
        }
        submodules = {name for name in names if name in modules}
        # A package that is named for one of its modules is not what is imported.
        graph[module] = {name for name in submodules if not any(one.startswith(f"{name}.") for one in submodules)}
    graphlib.TopologicalSorter(graph).prepare()


#: Parts that import in a function what is optional, or heavy and rarely needed.
LATE_IMPORTS = {"bags", "cli", "findings", "guard", "publishers", "rays", "resolve", "ros", "tf2"}


def test_nothing_is_imported_inside_a_function() -> None:
    """A circle would be broken that way; these parts alone load what is rarely needed where it is."""
    inside = [
        f"{file.relative_to(ROOT)}:{node.lineno}"
        for file in FILES
        for function in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef))
        for node in ast.walk(function)
        if isinstance(node, (ast.Import, ast.ImportFrom)) and part_of(file) not in LATE_IMPORTS
    ]
    assert not inside


def loaded_by(code: str) -> set[str]:
    """Return the modules that are loaded when a fresh interpreter has run the code."""
    program = f"import sys\nimport contextlib\nwith contextlib.suppress(SystemExit):\n    {code}\n"
    program += "sys.stderr.write('modules:' + ' '.join(sys.modules))"
    done = processes.run([sys.executable, "-c", program], check=True, cwd=ROOT)
    return set(done.stderr.rpartition("modules:")[2].split())


def foreign(modules: set[str], before: set[str]) -> set[str]:
    """Return the first names of modules that are neither the standard library's nor there without any import."""
    first = {name.partition(".")[0] for name in modules - before}
    return {name for name in first if name not in sys.stdlib_module_names and not name.startswith(("_", "tfcompose"))}


def command(*words: str) -> str:
    return f"from tfcompose.cli import main; main({list(words)!r})"


@pytest.fixture(scope="module")
def bare() -> set[str]:
    """Return what an interpreter of this environment has loaded before it runs anything."""
    return loaded_by("pass")


def parts_in(modules: set[str]) -> set[str]:
    return {name.split(".")[1] for name in modules if name.startswith("tfcompose.")}


def test_help_loads_the_commands_and_nothing_of_their_work(bare: set[str]) -> None:
    loaded = loaded_by(command("--help")) - bare
    assert not foreign(loaded, bare)
    assert parts_in(loaded) == {"cli", "geometry", "render", "signals", "text"}
    assert {name for name in loaded if name.startswith("tfcompose.cli.") and ".commands" not in name} == {
        f"tfcompose.cli.{name}"
        for name in ("command_parser", "documentation", "options", "parser", "schemas", "terminal")
    }
    assert not loaded & {"dataclasses", "difflib", "html", "socket", "subprocess"}


@pytest.mark.parametrize("words", [("ps",), ("down",), ("logs",), ("up", "plan.json", "--dry-run")])
def test_commands_after_the_plan_load_nothing_from_elsewhere_and_no_compiler(
    words: tuple[str, ...], bare: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    built = "tests/golden/my_robot/plan.json"
    loaded = loaded_by(command(*(built if word == "plan.json" else word for word in words)))
    assert not foreign(loaded, bare)
    assert {"launcher", "plan"} & parts_in(loaded)
    assert not parts_in(loaded) & {*STAGES, "compile", "emit"}


@pytest.mark.parametrize("words", [("lint",), ("tree",), ("build", "-o")], ids=lambda words: words[0])
def test_commands_before_the_plan_load_yaml_and_pydantic_and_nothing_else_from_elsewhere(
    words: tuple[str, ...], bare: set[str], tmp_path: Path
) -> None:
    more = [str(tmp_path)] if "-o" in words else []
    robot = "robots/autonomous_robot.yaml"
    loaded = loaded_by(command(words[0], robot, *words[1:], *more))
    pydantic = {"pydantic", "pydantic_core", "annotated_types", "typing_extensions", "typing_inspection"}
    assert foreign(loaded, bare) - {"cython_runtime"} == {"yaml", *pydantic}
    assert not loaded & {f"tfcompose.{name}" for name in ("ros", "process", "publishers", "launcher", "guard", "live")}


def test_reading_and_supervising_a_plan_loads_no_compiler_and_regex_alone_from_elsewhere(
    bare: set[str],
) -> None:
    loaded = loaded_by("import tfcompose.plan.file, tfcompose.launcher.supervisor")
    assert foreign(loaded, bare) - {"cython_runtime"} == {"regex"}
    assert not {name for name in loaded for stage in (*STAGES, "emit") if name.startswith(f"tfcompose.{stage}")}


def test_the_buffer_loads_neither_ros_nor_numpy_until_arrays_are_requested(bare: set[str]) -> None:
    one = "from tfcompose.tf2 import Buffer; from tfcompose.geometry import Pose; b = Buffer(); "
    one += "b.set('a', 'b', Pose(), 1, static=False); b.lookup_transform('a', 'b', 0)"
    assert not foreign(loaded_by(one), bare)
    assert "numpy" in foreign(loaded_by(one + "; b.lookup_many('a', 'b', [1])"), bare)


def test_the_buffer_stands_on_its_own() -> None:
    """It needs the geometry and nothing else of the package; what needs ROS are listeners and nodes."""
    loaded = {name.removeprefix("tfcompose.") for name in loaded_by("import tfcompose.tf2") if "tfcompose." in name}
    assert {name.partition(".")[0] for name in loaded} == {"tf2", "geometry"}


@pytest.mark.ros
@pytest.mark.parametrize("module", ["publishers.static", "publishers.simulate", "guard.process"])
def test_processes_that_need_no_arrays_load_no_numpy_and_no_pydantic(module: str) -> None:
    """Each is a fifth of their memory."""
    loaded = loaded_by(f"import tfcompose.{module}, tfcompose.publishers.description, tfcompose.ros.clock")
    assert not {"numpy", "pydantic", "pydantic_core"} & loaded
    assert "rclpy" in loaded
