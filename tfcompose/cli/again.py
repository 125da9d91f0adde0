"""``up`` where the robot runs already: what is different is changed, or it is said who runs it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.console import held
from tfcompose.cli.keeping import kept
from tfcompose.cli.missing import until_ready
from tfcompose.cli.running import asked, since
from tfcompose.cli.terminal import complain
from tfcompose.ipc import PlanChange, UpdateRequest

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

    from tfcompose.plan import Plan
    from tfcompose.run.place import Place


def up_again(plan: Plan, file: Path, place: Place, arguments: Namespace) -> int:
    """Bring the running robot to the plan; exit code 0, 1 where it runs as it is and was to be started here."""
    holder = place.holder()
    who = (
        f"{place.name} runs already: pid {holder.pid}, since {since(holder)}" if holder else f"{place.name} just ended"
    )
    copy = kept(plan, file, place, alone=False)
    if isinstance(copy, int):
        return copy
    answer = asked(place, UpdateRequest(str(copy), str(file.absolute().parent)), PlanChange)
    if isinstance(answer, int):
        complain(who)
        return answer
    parts = (("restarted", answer.changed), ("started", answer.added), ("stopped", answer.removed))
    said = "; ".join(f"{word}: {', '.join(names)}" for word, names in parts if names)
    if not said:
        background = arguments.detach or arguments.wait
        complain(f"{who}; the plan is the same; tfcompose down ends it")
        return (until_ready(place, arguments.timeout) if arguments.wait else 0) if background else 1
    sys.stdout.write(f"{who}; {said}\n")
    if answer.held:
        sys.stdout.write(f"{held(answer.held)}\n")
    return until_ready(place, arguments.timeout) if arguments.wait else 0
