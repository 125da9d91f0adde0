"""Parser of robot files as launch files: ``ros2 launch PACKAGE rover.tfc.yaml demo:=true``.

If no parser accepts a file by its ending, launch tries all parsers. Therefore this parser refuses
files with other endings immediately.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from launch import LaunchDescription, Substitution, frontend
from launch.actions import DeclareLaunchArgument
from launch.conditions import evaluate_condition_expression
from launch.substitutions import EnvironmentVariable, LaunchConfiguration

from tfcompose.foundation.findings import RejectedError
from tfcompose.tools.ros2.actions import TfCompose

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from typing import TextIO

    from launch import LaunchContext
    from typing_extensions import Self

    from tfcompose.spec.language import ArgSpec

#: The endings of robot files that launch accepts.
EXTENSIONS = frozenset({"tfc.yaml", "tfc.yml"})


class RobotFile(frontend.Entity):  # type: ignore[misc]  # launch has no types
    """A robot file; launch knows only its path."""

    type_name = "robot"
    parent = None
    children: tuple[frontend.Entity, ...] = ()

    def __init__(self, path: str) -> None:
        self.path = path


class RobotFileParser(frontend.Parser):  # type: ignore[misc]  # as above
    """Parser of robot files, for the entry-point group ``launch.frontend.parser``."""

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        """Return the endings of file names, without the first dot."""
        return set(EXTENSIONS)

    @classmethod
    def load(cls, file: str | TextIO) -> tuple[RobotFile, Self]:
        """Return the robot file without reading it.

        Raises:
            ValueError: if the file name does not end like a robot file's.
        """
        path = str(getattr(file, "name", file))
        if not cls.may_parse(path):
            endings = " or ".join(f".{extension}" for extension in sorted(EXTENSIONS))
            raise ValueError(f"{path} is not a robot file: its name does not end with {endings}")
        return RobotFile(path), cls()

    def parse_description(self, entity: RobotFile) -> LaunchDescription:
        """Return the robot's arguments and profiles as launch arguments, and its action.

        If the file has errors, there are no launch arguments, and the action reports the errors.
        """
        args, profiles = _interface(entity.path)
        names = {profile: _argument_of(profile, args) for profile in profiles}
        robot = TfCompose(
            file=entity.path,
            profiles=[_NameIfTrue(profile, argument) for profile, argument in names.items()],
            args={name: LaunchConfiguration(name) for name in args},
        )
        return RobotDescription(
            entity.path,
            [
                *(_declare(name, arg) for name, arg in args.items()),
                *(
                    DeclareLaunchArgument(
                        argument, default_value="false", description=f"apply the profile {profile}"
                    )
                    for profile, argument in names.items()
                ),
                robot,
            ],
        )


class RobotDescription(LaunchDescription):  # type: ignore[misc]  # as above
    """The launch description of a robot file, which lints the file for ``--show-args``."""

    def __init__(self, file: str, entities: Iterable[Any]) -> None:
        super().__init__(entities)
        self._file = file

    def get_launch_arguments(self, conditional_inclusion: bool = False) -> list[Any]:  # noqa: FBT001, FBT002 (launch's signature)
        """Return the launch arguments, and print the file's findings to stderr.

        ``ros2 launch --show-args`` calls this method; starting the file does not.
        """
        _print_findings(self._file)
        arguments: list[Any] = super().get_launch_arguments(conditional_inclusion)
        return arguments


class _NameIfTrue(Substitution):  # type: ignore[misc]  # as above
    """A substitution: a profile's name if its launch argument is true, else empty."""

    def __init__(self, name: str, argument: str) -> None:
        self._name = name
        self._argument = argument

    def describe(self) -> str:
        """Return a description for ``ros2 launch --print``."""
        return f"{self._name} if {self._argument}"

    def perform(self, context: LaunchContext) -> str:
        """Return the name or an empty string."""
        is_true = evaluate_condition_expression(context, [LaunchConfiguration(self._argument)])
        return self._name if is_true else ""


def _interface(file: str) -> tuple[Mapping[str, ArgSpec], tuple[str, ...]]:
    """Return the arguments and the names of the profiles; empty if the file has errors."""
    from tfcompose.cli.args import args_of
    from tfcompose.cli.compiling import load_robot
    from tfcompose.spec.language import profiles_in

    try:
        source = load_robot(file)
        return args_of(source), tuple(profiles_in(source))
    except RejectedError:
        return {}, ()


def _print_findings(file: str) -> None:
    """Print the findings of a robot file to stderr, without findings about missing arguments."""
    from tfcompose.cli.compiling import library, load_robot
    from tfcompose.cli.linting import Linter
    from tfcompose.cli.parser import parser_of
    from tfcompose.cli.reading import read_text
    from tfcompose.cli.terminal import print_findings

    linter = Linter(parser_of("lint").parse_args([file]), library(), os.environ, has_one_file=True)
    try:
        source = load_robot(file)
    except RejectedError as error:
        print_findings(error.findings, sys.stderr)
        return
    declared = {source.key_span(("args", name)) for name in source.mapping("args")}
    findings = linter.lint_robot(file, read_text)
    print_findings(
        [each for each in findings if each.code != "TF102" or each.span not in declared],
        sys.stderr,
    )


def _argument_of(profile: str, args: Mapping[str, Any]) -> str:
    """Return the name of a profile's launch argument.

    If an argument of the robot has the profile's name, the name is ``profile_NAME``.
    """
    return f"profile_{profile}" if profile in args else profile


def _declare(name: str, arg: ArgSpec) -> DeclareLaunchArgument:
    """Return the launch argument for an argument of the robot."""
    from tfcompose.spec.language.args import as_given

    default = None if arg.default is None else as_given(arg.default)
    if arg.env:
        default = EnvironmentVariable(arg.env, default_value=default)
    return DeclareLaunchArgument(
        name,
        default_value=default,
        description=arg.description or None,
        choices=list(arg.alternatives) if arg.choices and not arg.env else None,
    )
