"""``--show-args``: lists the arguments of a robot file."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import load_robot, overlays_of
from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.plans import is_plan
from tfcompose.cli.reading import read_text
from tfcompose.cli.terminal import UNREADABLE, fail, printable, reject
from tfcompose.foundation.findings import RejectedError
from tfcompose.spec.language import BuildInputs, compose, validate
from tfcompose.spec.language.args import as_given

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.spec.language import ArgSpec
    from tfcompose.spec.load import Source


def show_args(arguments: Namespace) -> int:
    """Print the arguments of the robot file.

    Return 0, or the exit code of ``build`` if the file cannot be read.
    """
    file = _file(arguments)
    if is_plan(file):
        fail(f"{file} is a built plan; only robot files have arguments", UNREADABLE)
    try:
        source = load_robot(file)
        args = args_of(source, arguments.profiles, overlays_of(arguments, source))
    except RejectedError as error:
        reject(error.findings)
    if not args:
        print(f"{file} has no args")
    for name, declared in args.items():
        print("\n".join(map(printable, _lines(name, declared))))
    return 0


def args_of(
    source: Source, profiles: Sequence[str] = (), overlays: Sequence[Source] = ()
) -> Mapping[str, ArgSpec]:
    """Return the arguments of a robot file with its ``profiles`` and overlays.

    Raises:
        RejectedError: if a file cannot be read; it contains the findings.
    """
    merged = compose(source, profiles, overlays, read=read_text)
    return validate(merged, inputs=BuildInputs({}, os.environ)).spec.args


def _file(arguments: Namespace) -> str:
    """Return the path of the robot file from the parsed arguments."""
    for name in ("file", "files", "old", "what"):
        value = getattr(arguments, name, None)
        if value:
            return str(value if isinstance(value, str) else value[0])
    return DEFAULT_FILE


def _lines(name: str, declared: ArgSpec) -> Iterator[str]:
    facts = [f"one of {', '.join(declared.alternatives)}" if declared.choices else declared.kind]
    bounds = (("at least", declared.min), ("at most", declared.max))
    facts += [f"{what} {bound}" for what, bound in bounds if bound is not None]
    facts.append(
        "required" if declared.default is None else f"default: {as_given(declared.default)}"
    )
    facts += [f"or {declared.env} in the environment"] if declared.env else []
    yield f"{name}:=…  {', '.join(facts)}"
    if declared.description:
        yield f"    {declared.description}"
