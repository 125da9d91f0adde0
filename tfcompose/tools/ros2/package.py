"""Files of a ROS package with a robot, with the build type ament_python or ament_cmake."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import escape

from tfcompose.model.files import File

if TYPE_CHECKING:
    from collections.abc import Iterator

_TEMPLATES = Path(__file__).parent / "templates"
_ENDING = ".in"


class BuildType(NamedTuple):
    """A build type of ament, with the files that it needs."""

    name: str
    build_depends: tuple[str, ...]
    test_depend: str
    has_marker: bool


AMENT_PYTHON = BuildType("ament_python", (), "python3-pytest", has_marker=True)
AMENT_CMAKE = BuildType("ament_cmake", ("ament_cmake",), "ament_cmake_pytest", has_marker=False)


class Maintainer(NamedTuple):
    """The maintainer in the manifest of a package."""

    name: str
    email: str


#: The maintainer that ``ros2 pkg create`` writes if Git has no author.
UNKNOWN = Maintainer("TODO", "user@todo.todo")


def package_files(
    package: str, robot: str, build_type: BuildType, maintainer: Maintainer
) -> Iterator[File]:
    """Yield the files of a package, except its robot files.

    The launch file of the package starts ``robots/ROBOT.tfc.yaml``.
    """
    depends = "".join(
        f"  <buildtool_depend>{name}</buildtool_depend>\n" for name in build_type.build_depends
    )
    values = {
        "package": package,
        "robot": robot,
        "maintainer": escape(maintainer.name),
        "email": escape(maintainer.email, {'"': "&quot;"}),
        "build_type": build_type.name,
        "build_depends": f"{depends}\n" if depends else "",
        "test_depend": build_type.test_depend,
    }
    for folder in ("common", build_type.name):
        for template in sorted((_TEMPLATES / folder).rglob(f"*{_ENDING}")):
            path = template.relative_to(_TEMPLATES / folder).as_posix()
            text = template.read_text("utf-8")
            for name, value in values.items():
                text = text.replace(f"@{name}@", value)
            yield File(path.removesuffix(_ENDING), text)
    if build_type.has_marker:
        yield File(f"resource/{package}", "")
