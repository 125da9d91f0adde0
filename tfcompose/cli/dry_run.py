"""``up --dry-run`` prints the processes of a plan for review.

The text depends on nothing but the plan.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.plans import PLAN, is_plan, plan_to_start, read_built_plan
from tfcompose.cli.reading import read_text
from tfcompose.cli.terminal import printable
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.text import plural
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.hosts import describe_share
from tfcompose.model.plan.topics import partition_of, private_topics
from tfcompose.model.process_keys import EXTRA_ARGUMENTS, SUPERVISION_KEYS, SURROUNDING_KEYS
from tfcompose.tf.ros.environment import FASTDDS_PROFILE, child_environment

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Iterator

    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.model.process_keys import ProcessKey


def dry_run(arguments: Namespace) -> int:
    """Print the processes of a robot or a built plan. Return the exit code of ``build``.

    The function writes no files.
    """
    if is_plan(arguments.file):
        file = Path(arguments.file)
        plan = read_built_plan(file)
        files = _parameter_files(plan, file.parent)
    else:
        files = _compile_files(arguments)
        plan = read_plan(files[PLAN], PLAN)
    print("\n".join(map(printable, _lines(plan_to_start(plan, arguments), files))))
    return 0


def _compile_files(arguments: Namespace) -> dict[str, str]:
    from tfcompose.cli.compiling import compile_or_exit
    from tfcompose.cli.writing import destination
    from tfcompose.compiler.emit import emit

    robot = compile_or_exit(arguments.file, arguments)
    _, target = destination(arguments, robot)
    return {file.path: file.text for file in emit(robot, target) if file.text}


def _parameter_files(plan: Plan, folder: Path) -> dict[str, str]:
    files = {}
    for process in plan.processes:
        if process.params_file is not None:
            file = folder / process.params_file
            try:
                inside = file.resolve().is_relative_to(folder.resolve())
                files[process.params_file] = (
                    read_text(str(file)) if inside else "(a link to outside of the plan's folder)"
                )
            except (RejectedError, OSError):
                files[process.params_file] = "(cannot be read)"
    return files


def _lines(plan: Plan, files: dict[str, str]) -> Iterator[str]:
    ros = plan.ros
    domain = "the environment's" if ros.domain_id is None else ros.domain_id
    processes = f"{len(plan.processes)} process{'es' * (len(plan.processes) != 1)}"
    yield f"robot {plan.robot}: {processes}, {plural(len(plan.edges), 'edge')}, domain: {domain}"
    yield from describe_share(plan)
    for name, argument in plan.args.items():
        is_bool = isinstance(argument, bool)
        value = str(argument).lower() if is_bool else _quote(str(argument))
        yield f"  arg      {name}:={value}"
    for name, value in plan.environment.items():
        yield f"  env      {name}={_quote(value)}, at build time"
    for process in plan.processes:
        yield ""
        yield from _process(plan, process, files)


def _process(plan: Plan, process: PlanProcess, files: dict[str, str]) -> Iterator[str]:
    yield f"{process.name} ({process.kind})"
    yield from _what(process)
    if plan.guard.mode == "strict" and process.kind not in ("external", "guard"):
        yield f"  fence    {_fence(plan, process)}"
    states = {name: f" → {state}" for name, state in process.lifecycle.items()}
    nodes = [name + states.get(name, "") for name in process.nodes]
    if nodes:
        yield f"  nodes    {', '.join(nodes)}"
    for name, value in _environment(plan, process).items():
        yield f"  env      {name}={_quote(value)}"
    yield from _settings(SURROUNDING_KEYS, process)
    for old, new in process.remap.items():
        yield f"  remap    {old} → {new}"
    if process.params_file is not None:
        yield f"  params   {process.params_file}"
        yield from (f"    | {line}" for line in files.get(process.params_file, "").splitlines())
    yield from _component(process)
    yield from _times(process)
    for edge in plan.edges_of(process.name):
        rate = f", {edge.rate:g} Hz" if edge.rate else ""
        yield f"  edge     {edge.name} ({edge.kind}{rate})"


def _what(process: PlanProcess) -> Iterator[str]:
    """Yield a line with the process's command, or with its component and container."""
    component = process.component
    if component:
        yield f"  loads    {component.package}/{component.plugin}, in {component.container}"
    elif process.kind != "external":
        yield f"  command  {' '.join(map(_quote, (*process.prefix, *process.argv)))}"


def _component(process: PlanProcess) -> Iterator[str]:
    """Yield the parameters and remappings of a component."""
    component = process.component
    for name, value in component.params.items() if component else ():
        yield f"  param    {name}: {json.dumps(value)}"
    yield from _settings((EXTRA_ARGUMENTS,), process)


def _settings(keys: Iterable[ProcessKey], process: PlanProcess) -> Iterator[str]:
    """Yield the lines of the process for these keys."""
    for key in keys:
        for label, text in key.lines_of(process):
            yield f"  {label:<8} {text}"


def _fence(plan: Plan, process: PlanProcess) -> str:
    topics = private_topics(plan).get(process.name)
    ways = {
        "partition": f"the partition {partition_of(plan)}",
        "remap": " and ".join(topics) if topics else "the usual topics: no remapping reaches it",
    }
    way = (
        ways.get(plan.guard.fence) or f"{ways['partition']} with Fast DDS, else to {ways['remap']}"
    )
    return f"its TF goes to {way}; the guard forwards the edges that it owns"


def _times(process: PlanProcess) -> Iterator[str]:
    if process.after:
        yield (
            f"  after    {', '.join(f'{name} is {what}' for name, what in process.after.items())}"
        )
    ready = process.ready
    if ready:
        what = {"exit": f"code {ready.number:g}", "time": f"{ready.number:g} s"}.get(
            ready.kind, ready.text
        )
        late = f", late after {ready.timeout_s:g} s" if ready.timeout_s is not None else ""
        yield f"  ready    {ready.kind} {what}{late}".rstrip()
    yield from _settings(SUPERVISION_KEYS, process)
    if process.host is not None:
        yield f"  host     {process.host}"


def _environment(plan: Plan, process: PlanProcess) -> dict[str, str]:
    """Return the variables that the process adds to the environment."""
    if process.kind in {"external", "component"}:
        return {}
    env = child_environment({}, plan.ros, is_built_in=process.kind != "run") | process.env
    folder = str(FASTDDS_PROFILE.parent)
    return {name: value.replace(folder, "${tfcompose}/ros") for name, value in sorted(env.items())}


def _quote(argument: str) -> str:
    plain = argument.replace("${", "").replace("}", "").replace("_", "").replace("-", "")
    return (
        argument
        if plain and all(c.isalnum() or c in "/.:=@%+," for c in plain)
        else "'" + argument.replace("'", "'\\''") + "'"
    )
