"""Entry for colcon, which builds Python packages by ``setup.py``; pyproject.toml has the rest."""

import warnings
from pathlib import Path

from setuptools import Distribution, setup

PROGRAM = "tfcompose/tools/ros2/install/bin/tfcompose"


class Package(Distribution):
    """The package, with the same program in ``bin`` as in ``lib/tfcompose``.

    The program that setuptools writes there runs the Python of colcon. If pip installed colcon,
    that is often one without tfcompose's dependencies.
    """

    def parse_command_line(self) -> bool:
        """Return whether there is a command; replace the program if colcon gave it."""
        is_given = super().parse_command_line()
        if not {"develop", "install"}.isdisjoint(self.commands):
            del self.entry_points["console_scripts"]
            self.data_files.append(("bin", [PROGRAM]))
        return bool(is_given)


# colcon build --symlink-install runs a link to this file, in a folder without pyproject.toml.
for name in ("pyproject.toml", "README.md"):
    if not Path(name).exists():
        Path(name).symlink_to(Path(__file__).resolve().with_name(name))

# Old versions call [tool.setuptools] a beta, new ones a table for the licence old. Both read them.
warnings.filterwarnings("ignore", module=r"setuptools\.config\.")
distribution = setup(distclass=Package)
for options in (distribution, distribution.metadata):
    options.python_requires = str(options.python_requires)  # colcon reads literals alone
