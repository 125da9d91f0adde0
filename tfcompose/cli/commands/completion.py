"""Print what completes commands in bash, zsh or fish.

Print a script for the shell. It completes commands, options and their values, presets, codes, profiles, frames of the
robot file, and robots and processes that run: eval "$(tfcompose completion bash)".
"""

from __future__ import annotations

from argparse import SUPPRESS
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

SCRIPTS = {
    "bash": """\
_tfcompose() {
    local IFS=$'\\n'
    COMPREPLY=($(tfcompose completion --at "$COMP_CWORD" -- "${COMP_WORDS[@]}" 2>/dev/null))
}
complete -o default -F _tfcompose tfcompose
""",
    "zsh": """\
#compdef tfcompose
_tfcompose() {
    local -a found
    found=(${(f)"$(tfcompose completion --at $((CURRENT - 1)) -- "${words[@]}" 2>/dev/null)"})
    if (( $#found )); then compadd -a found; else _files; fi
}
compdef _tfcompose tfcompose
""",
    "fish": """\
function __tfcompose
    set -l words (commandline -opc) (commandline -ct)
    tfcompose completion --at (math (count $words) - 1) -- $words 2>/dev/null
end
complete -c tfcompose -a '(__tfcompose)'
""",
}


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("words", nargs="*", metavar="SHELL", help="bash, zsh or fish; default: bash")
    parser.add_argument("--at", type=int, help=SUPPRESS)


def run(arguments: Namespace) -> int:
    """Print the script, or with --at what that word of a command line can be; exit code 2 for another shell."""
    if arguments.at is not None:
        from tfcompose.cli.completing import candidates

        for one in candidates(arguments.commands, arguments.words, arguments.at):
            print(one)
        return 0
    shell = arguments.words[0] if arguments.words else "bash"
    if shell not in SCRIPTS or len(arguments.words) > 1:
        fail(f"completes {', '.join(SCRIPTS)}; not {' '.join(arguments.words)}", UNREADABLE)
    print(SCRIPTS[shell], end="")
    return 0
