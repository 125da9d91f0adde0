"""Parts: a robot file, URDF or xacro as a subtree, or as a separate robot.

A part that is a robot file is resolved like any robot. Before that, it is overlaid with values
from the including robot: variables, prefix, namespace, shared frames and isolation. Afterwards its
entries get their names in the including robot.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.edges import add_edge
from tfcompose.compiler.resolve.isolation import settings_of
from tfcompose.compiler.resolve.part import PartEntry
from tfcompose.compiler.resolve.urdf_parts import resolve_urdf_part
from tfcompose.foundation.findings import Finding, Note, RejectedError, did_you_mean, finding
from tfcompose.model.robot import STATIC
from tfcompose.spec.language import BuildInputs, compose, load_named, validate, with_includes
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.compiler.resolve.part import Joined
    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Robot
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Source

    Reader = Callable[[str], str]
    Resolve = Callable[..., tuple[Draft, list[Finding]]]


#: Maximum number of parts of a robot, including nested parts.
MOST_PARTS = 100


def join(draft: Draft, resolve: Resolve) -> Iterator[Finding]:
    """Resolve the parts of a draft. Report a part that cannot be resolved."""
    spec = draft.spec
    prefix = settings_of(spec.ros).frame_prefix
    for name, declared in spec.parts.items():
        part = PartEntry(name, declared, spec, outer_prefix=prefix)
        try:
            draft.joined.append(part.join(*_robot_of(part, draft, resolve)))
        except RejectedError as error:
            part.findings += error.findings
            draft.broken |= {("parts", f"{name}/"), ("parts", part.prefix)}
        yield from part.findings
    draft.broken.update(*(part.robot.broken for part in draft.joined))


def _robot_of(part: PartEntry, draft: Draft, resolve: Resolve) -> tuple[Robot, frozenset[str]]:
    """Return the part under its own names, and the outer frames that it attaches to."""
    draft.collected.count += 1
    if draft.read is None or draft.collected.count > MOST_PARTS:
        message = f"more than {MOST_PARTS} parts" if draft.read else "files cannot be read here"
        raise RejectedError([finding("TF008", message, part.span)])
    if part.declared.spec is part.declared.urdf is part.declared.xacro is None:
        raise RejectedError([])  # the part was already rejected
    if part.declared.xacro is not None and part.path in draft.validated.broken:
        raise RejectedError([])  # rejected arguments are missing from the xacro call
    try:
        if part.declared.spec is not None:
            validated = _validate_part(part, part.declared.spec, draft, draft.read)
            inner, findings = resolve(validated, draft.library, draft.read, draft.disk, draft)
            part.findings += [
                _with_note(finding, part) for finding in (*validated.findings, *findings)
            ]
            return inner.robot, frozenset()
        made = resolve_urdf_part(part, draft.packages, draft.read)
    except RejectedError as error:
        raise RejectedError([_with_note(finding, part) for finding in error.findings]) from None
    for file in made.files:
        draft.collected.notes.setdefault(file, []).append(_note(part))
    part.findings += [_with_note(finding, part) for finding in made.findings]
    return made.robot, made.implied


def _validate_part(part: PartEntry, named: str, draft: Draft, read: Reader) -> Validated:
    """Return the robot file of a part, overlaid with values from the including robot."""
    span = part.spec.span_of((*part.path, "spec"))
    file = find_path(named, span)
    if file in draft.files:
        circle = " → ".join([*draft.files[draft.files.index(file) :], file])
        raise RejectedError([finding("TF015", f"robots are parts of each other: {circle}", span)])
    loaded = with_includes(load_named(read(file), file), read)
    draft.collected.notes.setdefault(file, []).append(_note(part))
    if loaded.has_key(("overlays",)):
        part.findings.append(_unused_overlays(part, loaded, span))
    holder = draft.validated.inputs
    inputs = BuildInputs(part.given_args(), holder.environment, day=holder.day)
    source = compose(loaded, part.declared.profiles, inputs=inputs)
    validated = validate(part.overlay_on(source), None, inputs)
    part.findings += _useless(part, file, validated)
    draft.collected.allows += validated.source.allows
    draft.collected.sources.append(validated.source)
    return validated


def _unused_overlays(part: PartEntry, loaded: Source, span: Span) -> Finding:
    """Return the finding that a part gets no overlay of single robots."""
    message = f"the part {part.name} gets no overlay of single robots: its file has overlays"
    notes = [Note("named here", loaded.key_span(("overlays",)))]
    advice = "only a robot that is started has them: give the part vars, args or profiles"
    return finding("TF023", message, span, notes=notes, help=advice, severity="warning")


def take(draft: Draft) -> Iterator[Finding]:
    """Add the parts to the draft: frames, edges and bodies with their new names, and mounts.

    If a name of a part already exists, the complete part is rejected.
    """
    for part in tuple(draft.joined):
        refusal = _name_clash(draft, part)
        if refusal:
            yield refusal
            draft.joined.remove(part)
            names = (*part.robot.frames, *(process.name for process in part.robot.processes))
            draft.broken |= {("parts", name) for name in names}
        else:
            yield from _take(draft, part)


def _take(draft: Draft, part: Joined) -> Iterator[Finding]:
    robot, keys, path = part.robot, part.declared, ("parts", part.name)
    draft.joints |= _joints_of(part)
    for name, span in robot.frames.items():
        draft.frames.setdefault(name, span)
    for name, link in robot.links.items():
        draft.links.setdefault(name, link)
    if keys.parent is not None and part.root is not None:
        switched = len(keys.parent) > 1  # then the owner of the part moves it between parents
        owner = keys.owner if switched else STATIC
        yield from add_edge(draft, path, part.root, keys, joint_name=keys.joint, owner=owner)
    draft.edges += [replace(edge, entry=(*path, *edge.entry)) for edge in robot.edges]
    draft.sensors += robot.sensors


def _joints_of(part: Joined) -> dict[str, Span]:
    """Return the named joints of a part, none for a part that is a separate robot."""
    named = [edge for edge in part.robot.edges if edge.joint_name and not part.declared.is_alone]
    return {edge.joint_name: edge.joint_at or edge.span for edge in named}


def _name_clash(draft: Draft, part: Joined) -> Finding | None:
    """Return a finding if the part defines names that already exist."""
    robot, joints = part.robot, _joints_of(part)
    hanging = {edge.child for edge in robot.edges}
    # The including file may give a shared root its edge.
    free = part.shared | (draft.spec.frames.keys() - hanging)
    frames = [name for name in robot.frames if name in draft.frames and name not in free]
    if frames:
        return _names_twice("frame", frames, draft.frames, robot.frames, part, draft.spec)
    twice = [name for name in joints if name in draft.joints]
    return _names_twice("joint", twice, draft.joints, joints, part, draft.spec) if twice else None


def _names_twice(  # noqa: PLR0913, PLR0917 (what is there, where, and who brings it)
    kind: str,
    names: list[str],
    existing: Mapping[str, Span],
    brought: Mapping[str, Span],
    part: Joined,
    spec: RobotSpec,
) -> Finding:
    first, more = names[0], f" and {len(names) - 1} more" if names[1:] else ""
    notes = [Note(f"{first} is defined here", existing[first]), Note("and here", brought[first])]
    advice, keys = f"a prefix of its own, prefix: {part.name}/", part.declared
    if kind == "frame":
        advice += f"; or ros: {{shared_frames: [{first}]}}"
        if not (keys.prefix or keys.root or names[1:] or first == part.root):
            advice = f"root: {first}, if the part begins there; or {advice}"
    message = f"the part {part.name} brings the {kind} {first}{more}, which already exists"
    span = spec.key_span(("parts", part.name))
    return finding("TF505", message, span, notes=notes, help=advice)


def _with_note(finding: Finding, part: PartEntry) -> Finding:
    return replace(finding, notes=(*finding.notes, _note(part)))


def _note(part: PartEntry) -> Note:
    return Note(f"as the part {part.name}", part.span)


def _useless(part: PartEntry, file: str, validated: Validated) -> Iterator[Finding]:
    """Yield a finding for each variable that the part gets but neither declares nor uses."""
    variables, replaced = part.declared.vars, validated.spec.spans.replaced
    names = [
        name for name in validated.spec.vars if name not in variables or ("vars", name) in replaced
    ]
    for section, name in validated.unused:
        if section == "vars" and name in variables and name not in names:
            span = part.spec.key_span((*part.path, "vars", name))
            advice = did_you_mean(name, names, "remove it")
            message = f"{file} does not use the variable {name}"
            yield finding("TF105", message, span, help=advice)
