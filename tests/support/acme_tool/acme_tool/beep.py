"""Beep as the robot's plan says.

Print where the beeper of PLAN is, and how far it is heard.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("plan", metavar="PLAN", help="a built plan.json")


def run(arguments: Namespace) -> int:
    """Beep; exit code 0."""
    from pathlib import Path

    from tfcompose.model.plan.file import read_plan

    text = Path(arguments.plan).read_text(encoding="utf-8")
    beeper = read_plan(text, arguments.plan).sections["acme"]
    print(f"beep on {beeper['frame']}, heard {beeper['reach']:g} m away")
    return 0
