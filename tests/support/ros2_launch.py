"""``ros2 launch`` as a process, where a distribution or stock parts of ROS are sourced."""

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain
from tests.support.processes import Started

HAS_ROS2_LAUNCH = shutil.which("ros2") is not None
needs_ros2_launch = pytest.mark.skipif(not HAS_ROS2_LAUNCH, reason="there is no ros2 launch")


def launch_command(*arguments: object) -> list[str]:
    """Return ``ros2 launch`` without a terminal, which hands an interrupt on."""
    return ["ros2", "launch", "--noninteractive", *map(str, arguments)]


class Ros2Launch:
    """Starts ``ros2 launch`` in a domain and a folder, with logs below it."""

    def __init__(self, domain: Domain, folder: Path) -> None:
        self.folder = folder
        self._environment = {**domain.environment, "ROS_LOG_DIR": str(folder / "log")}
        self._started: list[Started] = []

    def __call__(self, *arguments: object, **environment: str) -> Started:
        """Start it; it is ended with the test."""
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        process = processes.start(
            launch_command(*arguments),
            cwd=self.folder,
            env=self._environment | environment,
            **pipes,
        )
        self._started.append(Started(process))
        return self._started[-1]

    def write(self, name: str, text: str) -> Path:
        """Write a file into the folder."""
        file = self.folder / name
        file.write_text(text, encoding="utf-8")
        return file

    def plans(self) -> list[Path]:
        """Return the plans that robots were built to, below launch's logs."""
        return sorted((self.folder / "log").glob("**/build/plan.json"))

    def close(self) -> None:
        """End what still runs."""
        for started in self._started:
            started.close()


@pytest.fixture
def ros2_launch(domain: Domain, tmp_path: Path) -> Iterator[Ros2Launch]:
    """``ros2 launch`` in the test's domain and folder."""
    launch = Ros2Launch(domain, tmp_path)
    yield launch
    launch.close()
