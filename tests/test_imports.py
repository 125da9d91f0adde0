"""Who may import whom, read from syntax trees, and what commands really load."""

import ast
import graphlib
import re
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.house import PACKAGE, ROOT, imports_of, nodes_of, part_of, room_of

#: One worker parses all files, once.
pytestmark = pytest.mark.xdist_group("sources")

#: The nine wings, and which other wings each may import.
MAY_IMPORT: dict[str, set[str]] = {
    "foundation": set(),
    "model": {"foundation"},
    "spec": {"foundation", "model"},
    "compiler": {"foundation", "model", "spec"},
    "tf": {"foundation", "model"},
    "guard": {"foundation", "model", "tf"},
    "launcher": {"foundation", "model", "tf"},
    "cli": {"foundation", "model", "spec", "compiler", "tf", "guard", "launcher"},
    "tools": {"foundation", "model", "spec", "compiler", "tf", "guard", "launcher", "cli"},
}
#: What is no wing: the program, and files that are no modules.
TOP_FLOOR = {"__init__.py", "__main__.py", "py.typed", "data"}

#: The tools that ship, each a folder.
TOOLS = {path.parent.name for path in (PACKAGE / "tools").glob("*/tool.py")}

#: Packages from elsewhere, and the only rooms that may import them.
ONLY_IN: dict[str, set[str]] = {
    "yaml": {
        "spec.language.overlay_text",
        "spec.load",
        "tools.exporters",
        "tools.importers",
        "tools.rebag",
    },  # importers: launch reads parameters as YAML
    "launch_xml": {"tools.importers"},
    "launch_yaml": {"tools.importers"},
    "asyncssh": {"tools.deploy"},
    "ros2cli": {"tools.ros2"},
    "jinja2": {"tools.docs"},
    "markdown_it": {"tools.docs"},
    "markupsafe": {"tools.docs"},
    "pygments": {"tools.docs"},
    "pydantic": {
        "spec.language",
        "tools.fleet.spec",
        "tools.treetest.injections",
        "tools.treetest.spec",
    },
    "pydantic_core": {"spec.language", "foundation.units"},
    "typing_extensions": {"spec.language"},
    # compiler: what trimesh gives are its arrays
    "numpy": {
        "compiler.rays",
        "compiler.urdf",
        "launcher.publishers",
        "tf.ros",
        "tf.tf2",
        "tools.prove",
        "tools.rebag",
        "tools.view",
    },
    "xacro": {"compiler.urdf"},
    "trimesh": {"compiler.meshes", "compiler.rays", "tools.view"},
    "viser": {"tools.view"},
    "watchfiles": {"tools.view"},
    "websockets": {"tools.view"},
    "yourdfpy": {"compiler.urdf"},
    "resvg_py": {"compiler.draw"},
    "font_lato": {"compiler.draw"},
    "argcomplete": {"cli"},
    "msgspec": {"cli", "guard", "launcher", "model", "tools.exporters", "tools.treetest"},
    "regex": {"launcher"},
    "rich": {"cli"},
    "pytest": {"tools.treetest"},  # of a plug-in, which pytest loads
    "rclpy": {"tf.ros"},
    "zenoh": {"tf.ros", "tools.fleet"},
    "xxhash": {"tf.ros"},
    "rosbags": {"tf.bag_writing", "tf.bags", "tools.prove", "tools.rebag", "tools.treetest"},
    "mcap": {"tools.rebag"},
    "lz4": {"tools.rebag"},
    "zstandard": {"tools.rebag"},
    "tf2_msgs": {"tf.ros"},
    "geometry_msgs": {"tf.ros"},
    "sensor_msgs": {"tf.ros"},
    "nav_msgs": {"tf.ros"},
    "lifecycle_msgs": {"tf.ros"},
    "composition_interfaces": {"tf.ros"},
    "rcl_interfaces": {"tf.ros"},
    "launch": {"launcher", "tools.importers", "tools.ros2"},
    "launch_ros": {"launcher", "tools.importers"},
    "std_msgs": {"tf.ros"},
    "builtin_interfaces": {"tf.ros"},
    "rosgraph_msgs": {"tf.ros"},
    "diagnostic_msgs": {"guard"},
    "rosidl_generator_py": {"tf.ros"},
    "rosidl_parser": {"tf.ros"},
    "ament_index_python": {"tf.ros", "tools.importers"},
}


FILES = sorted(PACKAGE.rglob("*.py"))


def is_in(room: str, rooms: set[str]) -> bool:
    """Return whether a room is one of these, or inside one."""
    return any(room == parent_room or room.startswith(f"{parent_room}.") for parent_room in rooms)


def test_the_package_is_nine_wings_with_nothing_else_on_the_top_floor() -> None:
    names = {path.name for path in PACKAGE.iterdir() if path.name != "__pycache__"}
    assert names == MAY_IMPORT.keys() | TOP_FLOOR
    assert not list((PACKAGE / "data").rglob("*.py"))


def test_the_arrows_between_wings_lead_downwards() -> None:
    graphlib.TopologicalSorter(MAY_IMPORT).prepare()


@pytest.mark.parametrize("wing", sorted(MAY_IMPORT.keys() - {"tools"}))
def test_a_wing_says_what_it_must_not_import(wing: str) -> None:
    """Each wing's "Must not import" sentence agrees with the tables."""
    docstring = ast.get_docstring(ast.parse((PACKAGE / wing / "__init__.py").read_text("utf-8")))
    _, says, rest = " ".join((docstring or "").split()).partition("Must not import")
    assert says
    names = set(re.findall(r"``(\w+)``", re.split(r"[:.]", rest)[0]))
    assert names >= MAY_IMPORT.keys() - MAY_IMPORT[wing] - {wing}
    allowed = {
        package
        for package, rooms in ONLY_IN.items()
        if any(room.startswith(wing) for room in rooms)
    }
    assert not names & (MAY_IMPORT[wing] | allowed)
    assert names <= MAY_IMPORT.keys() | ONLY_IN.keys()


@pytest.mark.parametrize("file", FILES, ids=room_of)
def test_a_file_imports_only_what_its_wing_may(file: Path) -> None:
    wing = part_of(file)
    if wing == "__init__":
        assert not imports_of(file)
        return
    if wing == "__main__":
        assert {name for name in imports_of(file) if name.startswith("tfcompose")} == {
            "tfcompose.cli",
            "tfcompose.launcher.program",
        }
        return
    for name in imports_of(file):
        first, _, rest = name.partition(".")
        if first == "tfcompose" and rest:
            assert rest.partition(".")[0] in {wing, *MAY_IMPORT[wing]}, f"{wing} imports {name}"
    for name in imports_of(file, for_types=False):
        first = name.partition(".")[0]
        if first not in {*sys.stdlib_module_names, "tfcompose"}:
            assert is_in(room_of(file), ONLY_IN.get(first, set())), (
                f"{room_of(file)} imports {name}"
            )


#: The rooms that are stages: what they keep in their files is their own.
STAGES = {"spec.load", "spec.language", "compiler.resolve", "compiler.check"}


def test_every_folder_of_the_tools_is_a_tool() -> None:
    folders = {path.name for path in (PACKAGE / "tools").iterdir() if path.is_dir()}
    assert folders - {"__pycache__"} == TOOLS


@pytest.mark.parametrize("file", sorted(PACKAGE.glob("tools/*/**/*.py")), ids=room_of)
def test_no_tool_imports_another(file: Path) -> None:
    tool = file.relative_to(PACKAGE / "tools").parts[0]
    for name in imports_of(file):
        if name.startswith("tfcompose.tools"):
            assert name.split(".")[2] == tool, f"{tool} imports {name}"


@pytest.mark.parametrize("file", [file for file in FILES if part_of(file) != "tools"], ids=room_of)
def test_the_core_names_its_tools_in_one_place(file: Path) -> None:
    """Neither an import nor a name for one: the loader alone knows where the table is."""
    texts = {
        node.value
        for node in nodes_of(file)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    named = {text for text in texts if re.fullmatch(r"tfcompose\.tools(\.[\w.:]+)?", text)}
    assert named <= ({"tfcompose.tools"} if room_of(file) == LOADER else set())


@pytest.mark.parametrize("file", FILES, ids=room_of)
def test_a_stage_is_imported_by_its_own_name_from_outside(file: Path) -> None:
    """Outside, ``from tfcompose.compiler.check import check``."""
    if part_of(file) in {"spec", "compiler", "cli", "tools"}:
        return
    for name in imports_of(file):
        assert not any(name.startswith(f"tfcompose.{stage}.") for stage in STAGES), name


def test_launcher_and_publishers_do_not_know_each_other() -> None:
    """They are processes of their own: what they tell each other stands in ``model.messages``."""
    launcher = [file for file in FILES if is_in(room_of(file), {"launcher"})]
    assert any(is_in(room_of(file), {"launcher.publishers"}) for file in launcher)
    for file in launcher:
        publishes = is_in(room_of(file), {"launcher.publishers"})
        for name in imports_of(file):
            if name.startswith("tfcompose.launcher."):
                assert name.startswith("tfcompose.launcher.publishers") is publishes, file


def test_a_command_is_imported_by_the_parser_alone() -> None:
    """What several commands share stands in ``cli`` itself."""
    importers = [
        file.relative_to(PACKAGE).as_posix()
        for file in FILES
        if any(name.startswith("tfcompose.cli.commands") for name in imports_of(file))
    ]
    assert importers == ["cli/parser.py"]


def test_no_module_imports_itself_by_way_of_others_not_even_for_its_types() -> None:
    modules = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
        for file in FILES
    }
    graph: dict[str, set[str]] = {}
    for module, file in modules.items():
        names = {
            name
            for node in nodes_of(file)
            if isinstance(node, ast.ImportFrom) and node.module
            for name in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
        }
        submodules = {name for name in names if name in modules}
        # A package that is named for one of its modules is not what is imported.
        graph[module] = {
            name
            for name in submodules
            if not any(submodule.startswith(f"{name}.") for submodule in submodules)
        }
    graphlib.TopologicalSorter(graph).prepare()


#: Parts that import in a function what is optional, or heavy and rarely needed.
LATE_IMPORTS = {
    *(
        "__main__",
        "cli",
        "compiler.rays",
        "compiler.resolve",
        "foundation.findings",
        "foundation.tool",
        "guard",
        "launcher.publishers",
    ),
    *("tf.bags", "tf.ros", "tf.tf2"),
    *(f"tools.{tool}" for tool in TOOLS),
}
#: The place that loads tools, by name: no wing imports them.
LOADER = "foundation.tool"


def test_nothing_is_imported_inside_a_function() -> None:
    """A circle would be broken that way.

    These parts alone load what is rarely needed where it is.
    """
    inside = [
        f"{file.relative_to(ROOT)}:{node.lineno}"
        for file in FILES
        for function in nodes_of(file)
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef))
        for node in ast.walk(function)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        and not is_in(room_of(file), LATE_IMPORTS)
    ]
    assert not inside


def loaded_by(code: str) -> set[str]:
    """Return the modules that are loaded when a fresh interpreter has run the code."""
    program = f"import sys\nimport contextlib\nwith contextlib.suppress(SystemExit):\n    {code}\n"
    program += "sys.stderr.write('modules:' + ' '.join(sys.modules))"
    done = processes.run([sys.executable, "-c", program], check=True, cwd=ROOT)
    return set(done.stderr.rpartition("modules:")[2].split())


def foreign(modules: set[str], before: set[str]) -> set[str]:
    """Return the top-level names of third-party modules that an import loaded."""
    first = {name.partition(".")[0] for name in modules - before}
    return {
        name
        for name in first
        if name not in sys.stdlib_module_names and not name.startswith(("_", "tfcompose"))
    }


def command(*words: str) -> str:
    return f"from tfcompose.cli import main; main({list(words)!r})"


@pytest.fixture(scope="module")
def bare() -> set[str]:
    """Return what an interpreter of this environment has loaded before it runs anything."""
    return loaded_by("pass")


def wings_in(modules: set[str]) -> set[str]:
    return {name.split(".")[1] for name in modules if name.startswith("tfcompose.")}


def rooms_in(modules: set[str], rooms: set[str]) -> set[str]:
    return {name for name in modules if is_in(name.removeprefix("tfcompose."), rooms)}


def test_help_loads_the_commands_and_nothing_of_their_work(bare: set[str]) -> None:
    loaded = loaded_by(command("--help")) - bare
    assert not foreign(loaded, bare)
    assert wings_in(loaded) == {"cli", "compiler", "foundation", "tools"}
    tables = {
        "tools",
        *(f"tools.{tool}" for tool in TOOLS),
        *(f"tools.{tool}.tool" for tool in TOOLS),
    }
    assert rooms_in(loaded, {"tools"}) == {f"tfcompose.{name}" for name in tables}
    assert not rooms_in(
        loaded, {"foundation.findings", "foundation.catalogue", "foundation.units"}
    )
    assert {
        name for name in loaded if name.startswith("tfcompose.cli.") and ".commands" not in name
    } == {
        f"tfcompose.cli.{name}"
        for name in (
            "command_parser",
            "documentation",
            "options",
            "parser",
            "robot_search",
            "schemas",
            "start_command",
            "templates",
            "terminal",
            "tool_commands",
        )
    }
    assert not loaded & {"dataclasses", "difflib", "html", "socket", "subprocess"}


@pytest.mark.parametrize(
    "words", [("ps",), ("down",), ("logs",), ("up", "plan.json", "--dry-run")]
)
def test_commands_after_the_plan_load_only_msgspec_and_no_compiler(
    words: tuple[str, ...], bare: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    built = "tests/golden/my_robot/plan.json"
    loaded = loaded_by(command(*(built if word == "plan.json" else word for word in words)))
    assert foreign(loaded, bare) == {"msgspec", "typing_extensions"}
    assert {"launcher", "model"} & wings_in(loaded)
    assert not rooms_in(
        loaded, {"spec", "compiler.resolve", "compiler.check", "compiler.compile", "compiler.emit"}
    )


@pytest.mark.parametrize(
    "words", [("lint",), ("tree",), ("build", "-o")], ids=lambda words: words[0]
)
def test_commands_before_the_plan_load_only_yaml_pydantic_and_msgspec(
    words: tuple[str, ...], bare: set[str], tmp_path: Path
) -> None:
    more = [str(tmp_path)] if "-o" in words else []
    robot = "robots/autonomous_robot.yaml"
    loaded = loaded_by(command(words[0], robot, *words[1:], *more))
    pydantic = {
        "pydantic",
        "pydantic_core",
        "annotated_types",
        "typing_extensions",
        "typing_inspection",
    }
    assert foreign(loaded, bare) - {"cython_runtime"} == {"msgspec", "yaml", *pydantic}
    assert not wings_in(loaded) & {"tf", "launcher", "guard"}


def test_supervising_a_plan_loads_no_compiler_and_few_dependencies(
    bare: set[str],
) -> None:
    loaded = loaded_by("import tfcompose.model.plan.file, tfcompose.launcher.supervisor")
    assert foreign(loaded, bare) - {"cython_runtime", "typing_extensions"} == {"msgspec", "regex"}
    assert wings_in(loaded) == {"foundation", "launcher", "model", "tf"}


def test_the_buffer_loads_neither_ros_nor_numpy_until_arrays_are_requested(bare: set[str]) -> None:
    program = (
        "from tfcompose.tf.tf2 import Buffer; from tfcompose.foundation.geometry import Pose; b ="
        " Buffer(); "
    )
    program += "b.set('a', 'b', Pose(), 1, static=False); b.lookup_transform('a', 'b', 0)"
    assert not foreign(loaded_by(program), bare)
    assert "numpy" in foreign(loaded_by(program + "; b.lookup_many('a', 'b', [1])"), bare)


def test_the_buffer_stands_on_its_own() -> None:
    """It needs the geometry and nothing else of the package.

    What needs ROS are listeners and nodes.
    """
    loaded = {
        name.removeprefix("tfcompose.")
        for name in loaded_by("import tfcompose.tf.tf2")
        if "tfcompose." in name
    }
    assert {name for name in loaded if not is_in(name, {"tf.tf2"})} == {
        "foundation",
        "foundation.geometry",
        "tf",
    }


@pytest.mark.ros
@pytest.mark.parametrize(
    "module", ["launcher.publishers.static", "launcher.publishers.simulate", "guard.process"]
)
def test_processes_that_need_no_arrays_load_no_numpy_and_no_pydantic(module: str) -> None:
    """Each is a fifth of their memory."""
    loaded = loaded_by(
        f"import tfcompose.{module}, tfcompose.launcher.publishers.description,"
        " tfcompose.tf.ros.clock"
    )
    assert not {"numpy", "pydantic", "pydantic_core"} & loaded
    assert "rclpy" in loaded
