"""Robot files as launch files: a parser for ``ros2 launch PACKAGE rover.tfc.yaml demo:=true``.

launch asks each parser for files that no parser could read, too, so that this one refuses files of
other names at once.
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

#: The endings of robot files that launch reads.
EXTENSIONS = frozenset({"tfc.yaml", "tfc.yml"})


class RobotFile(frontend.Entity):  # type: ignore[misc]  # launch has no types
    """A robot file, of which launch knows the path alone."""

    type_name = "robot"
    parent = None
    children: tuple[frontend.Entity, ...] = ()

    def __init__(self, path: str) -> None:
        self.path = path


class RobotFileParser(frontend.Parser):  # type: ignore[misc]  # as above
    """Parser of robot files, for the entry-point group ``launch.frontend.parser``."""

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        """Return the endings of names, without a dot before them."""
        return set(EXTENSIONS)

    @classmethod
    def load(cls, file: str | TextIO) -> tuple[RobotFile, Self]:
        """Return the robot file, unread.

        Raises:
            ValueError: if its name is not that of a robot file.
        """
        path = str(getattr(file, "name", file))
        if not cls.may_parse(path):
            endings = " or ".join(f".{extension}" for extension in sorted(EXTENSIONS))
            raise ValueError(f"{path} is not a robot file: its name does not end with {endings}")
        return RobotFile(path), cls()

    def parse_description(self, entity: RobotFile) -> LaunchDescription:
        """Return the robot's arguments and profiles as launch arguments, and its action.

        A file that cannot be read has none; the action reports why.
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
    """A robot file's launch description, which lints the file where its arguments are listed."""

    def __init__(self, file: str, entities: Iterable[Any]) -> None:
        super().__init__(entities)
        self._file = file

    def get_launch_arguments(self, conditional_inclusion: bool = False) -> list[Any]:  # noqa: FBT001, FBT002 (launch's signature)
        """Return the launch arguments, and print the file's findings to stderr.

        ``ros2 launch --show-args`` calls this; a launch does not.
        """
        _print_findings(self._file)
        arguments: list[Any] = super().get_launch_arguments(conditional_inclusion)
        return arguments


class _NameIfTrue(Substitution):  # type: ignore[misc]  # as above
    """A profile's name if its launch argument is true, else nothing."""

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
    """Return the arguments and the names of the profiles; none where the file has findings."""
    from tfcompose.cli.args import args_and_profiles

    try:
        return args_and_profiles(file)
    except RejectedError:
        return {}, ()


def _print_findings(file: str) -> None:
    """Print the findings of a robot file to stderr; a required argument may lack a value."""
    from tfcompose.cli.compiling import library
    from tfcompose.cli.linting import Linter
    from tfcompose.cli.parser import parser_of
    from tfcompose.cli.reading import read_text
    from tfcompose.cli.terminal import print_findings
    from tfcompose.spec.language import with_includes
    from tfcompose.spec.load import load

    linter = Linter(parser_of("lint").parse_args([file]), library(), os.environ, has_one_file=True)
    try:
        source = with_includes(load(read_text(file), file), read_text)
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
    """Return the name of a profile's launch argument; an argument of the robot has precedence."""
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
