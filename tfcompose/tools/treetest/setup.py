"""Setup of a live case: a file for the case's process and for the relays of its robot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from tfcompose.foundation.findings import Finding
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.spec.load import load
from tfcompose.tools.treetest.case import Case
from tfcompose.tools.treetest.spec import SuiteSpec, validate_suite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Self


class LiveSetup(msgspec.Struct, frozen=True):
    """What the process of a case is given."""

    #: The name and the text of the test file, and the number of the case in it.
    file: str
    text: str
    number: int
    #: The plan with the reserved ROS domain, as JSON.
    plan: str
    #: The robot file.
    robot: str
    #: The path of the golden recording; None: there is none.
    golden: str | None
    #: Whether xacro files may run outside of the sandbox.
    trust: bool
    #: The folder for files of the case and of the robot.
    folder: str
    #: The process that it ends with.
    parent: int
    #: Whether to leave files for inspection there.
    keeps: bool

    @classmethod
    def of(cls, case: Case, folder: Path, parent: int, *, keeps: bool) -> Self:
        """Return the setup of a case."""
        return cls(
            case.file,
            case.text,
            int(case.path[-1]),
            write_plan(case.plan),
            case.robot,
            case.golden,
            case.trust,
            str(folder),
            parent,
            keeps,
        )

    @classmethod
    def read(cls, file: str) -> Self:
        """Return the setup that ``write`` wrote."""
        return msgspec.json.decode(Path(file).read_bytes(), type=cls)

    def write(self) -> None:
        """Write it to its file."""
        self.path.write_bytes(msgspec.json.encode(self))

    @property
    def case(self) -> Case:
        """The case, read again."""
        source = load(self.text, self.file, SuiteSpec.BEGIN)
        return Case(
            validate_suite(source).cases[self.number],
            source,
            self.text,
            ("cases", self.number),
            plan=read_plan(self.plan, self.robot),
            robot=self.robot,
            bag=None,
            trust=self.trust,
            golden=self.golden,
        )

    @property
    def path(self) -> Path:
        """The file with this, as JSON."""
        return Path(self.folder, "setup.json")

    @property
    def result(self) -> Path:
        """The file with the findings, as JSON."""
        return Path(self.folder, "result.json")

    def write_findings(self, findings: Sequence[Finding]) -> None:
        """Write the findings of the case to their file."""
        self.result.write_bytes(msgspec.json.encode(findings))

    def read_findings(self) -> list[Finding]:
        """Return the findings that ``write_findings`` wrote."""
        return msgspec.json.decode(self.result.read_bytes(), type=list[Finding])

    @property
    def errors(self) -> Path:
        """The file with what the process prints."""
        return Path(self.folder, "judge.log")

    def begin_file(self, number: int) -> Path:
        """Return the file that the case makes when a fault is due, by its number in the case."""
        return Path(self.folder, f"begin-{number}")

    def begun_file(self, number: int, process: str) -> Path:
        """Return the file that a relay then makes, for the process to which it belongs."""
        return Path(self.folder, f"begun-{number}-{process.replace('/', '.')}")
