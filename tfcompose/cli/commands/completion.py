"""Print what completes commands in bash, zsh or fish.

Print a script for the shell. It completes commands, options and their values, presets, codes,
profiles, frames of the robot file, and robots and processes that run: eval "$(tfcompose completion
bash)".
"""

from __future__ import annotations

from argparse import SUPPRESS
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import FAILED, UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

SCRIPTS = {
    "bash": (
        """\
_tfcompose() {
    local found
    COMPREPLY=()
    found=$(tfcompose completion --line "${COMP_LINE:0:COMP_POINT}" \\
        --breaks "$COMP_WORDBREAKS" 2>/dev/null) && compopt +o default
    [[ $found == *= ]] && compopt -o nospace
    [[ $found ]] && mapfile -t COMPREPLY <<< "$found"
}
complete -o default -F _tfcompose tfcompose
"""
    ),
    "zsh": (
        """\
#compdef tfcompose
_tfcompose() {
    local text files
    local -a found space
    text=$(tfcompose completion --at $((CURRENT - 1)) -- "${(Q)words[@]}" 2>/dev/null) || files=1
    found=(${(f)text})
    [[ $text == *= ]] && space=(-S '')
    (( $#found )) && compadd "${space[@]}" -a found
    [[ -n $files ]] && { compset -P '--*='; _files; }
}
compdef _tfcompose tfcompose
"""
    ),
    "fish": (
        """\
function __tfcompose
    set -l words (commandline -opc)
    set -l word (commandline -ct)
    tfcompose completion --at (count $words) -- $words "$word" 2>/dev/null
    and return
    set -l option (string match -r -- '^--[^=]*=' "$word")
    for path in (__fish_complete_path (string replace -r -- '^--[^=]*=' '' "$word"))
        echo "$option$path"
    end
end
complete -c tfcompose -f -a '(__tfcompose)'
"""
    ),
}


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("words", nargs="*", metavar="|".join(SCRIPTS), help="default: bash")
    parser.add_argument("--at", type=int, help=SUPPRESS)
    parser.add_argument("--line", help=SUPPRESS)
    parser.add_argument("--breaks", default="", help=SUPPRESS)


def run(arguments: Namespace) -> int:
    """Print the script; exit code 2 for another shell.

    With --at print what that word of a command line can be, with --line what its last one can be,
    behind its last character of --breaks: bash replaces only that. Exit code 1 says that it can be
    a file as well.
    """
    if arguments.at is not None or arguments.line is not None:
        from tfcompose.cli.completing import candidates, split_line

        words = arguments.words if arguments.line is None else split_line(arguments.line)
        at = len(words) - 1 if arguments.at is None else arguments.at
        found, files = candidates(arguments.commands(), words, at)
        last = words[at] if 0 <= at < len(words) else ""
        kept = max((last.rfind(one) + 1 for one in arguments.breaks), default=0)
        for one in found:
            print(one[kept:])
        return FAILED if files else 0
    shell = arguments.words[0] if arguments.words else "bash"
    if shell not in SCRIPTS or len(arguments.words) > 1:
        fail(f"completes {', '.join(SCRIPTS)}; not {' '.join(arguments.words)}", UNREADABLE)
    print(SCRIPTS[shell], end="")
    return 0
