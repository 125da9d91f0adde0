"""Print a completion script for bash, zsh or fish.

Print a script for the shell. It completes commands, options and their values, presets, codes,
profiles, frames of the robot file, and robots and processes that run: eval "$(tfcompose completion
bash)".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

SHELLS = ("bash", "zsh", "fish")
#: argcomplete's script switches ``nospace`` off where bash can, so bash appends the space. Without
#: ``default``, bash lists no files when there are no completions.
_BASH_OPTIONS = ("-o", "nospace")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("shell", nargs="?", choices=SHELLS, default="bash", help="default: bash")


def run(arguments: Namespace) -> int:
    """Print the script; exit code 0."""
    from argcomplete.shell_integration import shellcode

    print(shellcode(["tfcompose"], shell=arguments.shell, complete_arguments=_BASH_OPTIONS))
    return 0
