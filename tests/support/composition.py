"""The package ``composition_interfaces``, made by the generators of PyPI, for tests.

PyPI has no such package, and rclpy needs compiled type support: a C compiler makes it, of the
fields that the services of rclcpp_components have. One library holds all of it.
"""

import fcntl
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np

NAME = "composition_interfaces"
#: The fields of each service's request and response, in IDL.
SERVICES = {
    "LoadNode": (
        """string package_name; string plugin_name; string node_name; string node_namespace; uint8 log_level;
        sequence<string> remap_rules; sequence<rcl_interfaces::msg::Parameter> parameters;
        sequence<rcl_interfaces::msg::Parameter> extra_arguments;""",  # noqa: E501 (a text as its reader has it)
        "boolean success; string error_message; string full_node_name; uint64 unique_id;",
    ),
    "UnloadNode": ("uint64 unique_id;", "boolean success; string error_message;"),
    "ListNodes": (
        "uint8 structure_needs_at_least_one_member;",
        "sequence<string> full_node_names; sequence<uint64> unique_ids;",
    ),
}
_GENERATE = """
import sys
from pathlib import Path
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport

name, share, *files = sys.argv[1:]
only = ["rosidl_typesupport_fastrtps_c"]
for generator in (
    GenerateC("c"),
    GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
    GenerateCTypesupport("c", typesupport_implementations=only),
    GenerateFastRTPSCTypesupport("fastrtps_c"),
):
    generator.generate(name, files, [share], Path.cwd() / name)
"""
#: The libraries that it is made of.
_LIBRARIES = (
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_fastrtps_cpp",
    "fastcdr",
    "rmw",
    *(
        f"{package}__{kind}"
        for package in ("rcl_interfaces", "service_msgs")
        for kind in (
            "rosidl_generator_c",
            "rosidl_generator_py",
            "rosidl_typesupport_c",
            "rosidl_typesupport_fastrtps_c",
        )
    ),
)


def can_build() -> bool:
    """Return whether there is what it takes: a compiler, and ROS of PyPI with its headers."""
    tools = shutil.which("gcc") and shutil.which("g++")
    return bool(tools) and (Path(sys.prefix) / "include/rosidl_typesupport_fastrtps_c").is_dir()


def composition_interfaces(folder: Path) -> Path:
    """Return a folder for PYTHONPATH that has the package.

    It is built there once, whoever asks first.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "done").exists():
            _generate(folder)
            _compile(folder)
            (folder / "done").touch()
    return folder


def _generate(folder: Path) -> None:
    sources = []
    for service, (request, response) in SERVICES.items():
        file = folder / "srv" / f"{service}.idl"
        file.parent.mkdir(exist_ok=True)
        parts = "".join(
            f"struct {service}_{part} {{ {fields} }}; "
            for part, fields in (("Request", request), ("Response", response))
        )
        includes = (
            '#include "rcl_interfaces/msg/Parameter.idl"\n' if "rcl_interfaces" in request else ""
        )
        file.write_text(f"{includes}module {NAME} {{ module srv {{ {parts} }}; }};\n")
        sources.append(f"srv/{service}.idl")
    share = f"{sys.prefix}/share"
    environment = os.environ | {"AMENT_PREFIX_PATH": sys.prefix}
    command = [sys.executable, "-c", _GENERATE, NAME, share, *sources]
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    (folder / NAME / "__init__.py").touch()


def _compile(folder: Path) -> None:
    package = folder / NAME
    headers = Path(sys.prefix) / "include"
    includes = [folder, headers, *sorted(headers.iterdir()), sysconfig.get_path("include")]
    flags = ["-O0", "-fPIC", *(f"-I{path}" for path in (*includes, np.get_include()))]
    objects = []
    for source in [*sorted(package.rglob("*.c")), *sorted(package.rglob("*.cpp"))]:
        objects.append(f"{source}.o")
        compiler = "gcc" if source.suffix == ".c" else "g++"
        subprocess.run(
            [compiler, "-c", *flags, str(source), "-o", objects[-1]],
            check=True,
            capture_output=True,
        )
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    library = package / f"{NAME}_s__rosidl_typesupport_c{suffix}"
    lib_folder = f"{sys.prefix}/lib"
    names = [f"-l{name}" for name in _LIBRARIES]
    link = [
        "g++",
        "-shared",
        *objects,
        "-o",
        str(library),
        f"-L{lib_folder}",
        f"-Wl,-rpath,{lib_folder}",
        *names,
    ]
    subprocess.run(link, check=True, capture_output=True)
