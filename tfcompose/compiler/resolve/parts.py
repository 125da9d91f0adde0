"""Parts: a robot file, URDF or xacro as a subtree, or as a robot beside others.

A robot file as a part is resolved like any robot, with what the holder says laid over it: values
of variables, the prefix, the namespace, the shared frames and the isolation. Then a part gets the
names that it has in the holder.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.foreign import foreign
from tfcompose.compiler.resolve.part import PartEntry
from tfcompose.compiler.resolve.resolved import Collected, Resolved
from tfcompose.foundation.findings import Finding, Note, RejectedError, did_you_mean, finding
from tfcompose.spec.language import Given, composed, load_named, validate, with_includes
from tfcompose.spec.load import path_named

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.compiler.resolve.part import Joined
    from tfcompose.compiler.resolve.presets import Library
    from tfcompose.compiler.urdf.packages import Disk, Packages
    from tfcompose.model.robot import Robot
    from tfcompose.spec.language import Validated

    Reader = Callable[[str], str]


#: How many parts a robot may have, those of its parts counted.
MOST_PARTS = 100


@dataclass(slots=True)
class Parts:
    """Resolves the parts of one robot file, and theirs.

    ``resolve`` is what resolves a robot within these ``files``.

    ``environment`` is what their files may read of it.
    """

    library: Library
    read: Reader | None
    disk: Disk | None
    resolve: Callable[..., Resolved]
    environment: Mapping[str, str]
    files: tuple[str, ...] = ()
    collected: Collected = field(default_factory=Collected)
    found: list[Finding] = field(default_factory=list)
    missing: list[tuple[str, str]] = field(default_factory=list)

    def join(self, validated: Validated, prefix: str, packages: Packages) -> list[Joined]:
        """Return the parts of a robot whose own frames have the prefix.

        Those that cannot be had are findings.
        """
        spec, joined = validated.spec, []
        for name, declared in spec.parts.items():
            part = PartEntry(
                name,
                declared,
                spec,
                outer_prefix=prefix,
                is_broken=("parts", name) in validated.broken,
            )
            try:
                joined.append(part.joined(*self._robot(part, packages)))
                self.found += part.found
            except RejectedError as error:
                self.found += [*part.found, *error.findings]
                self.missing += [("parts", f"{name}/"), ("parts", part.prefix)]
        return joined

    def _robot(self, part: PartEntry, packages: Packages) -> tuple[Robot, frozenset[str]]:
        """Return the part under its own names, and the frames of its holder it attaches to."""
        self.collected.count += 1
        if self.read is None or self.collected.count > MOST_PARTS:
            message = f"more than {MOST_PARTS} parts" if self.read else "files cannot be read here"
            raise RejectedError([finding("TF008", message, part.place)])
        if part.declared.spec is part.declared.urdf is part.declared.xacro is None:
            raise RejectedError([])  # it was refused already
        if part.declared.xacro is not None and part.is_broken:
            raise RejectedError([])  # and so were arguments, which xacro would miss
        try:
            if part.declared.spec is not None:
                return self._resolved(part, part.declared.spec, self.read), frozenset()
            made = foreign(part, packages, self.read)
        except RejectedError as error:
            raise RejectedError([_noted(one, part) for one in error.findings]) from None
        for file in made.files:
            self.collected.notes.setdefault(file, []).append(_note(part))
        self.found += [_noted(one, part) for one in made.found]
        return made.robot, made.implied

    def _resolved(self, part: PartEntry, named: str, read: Reader) -> Robot:
        at = part.spec.at((*part.at, "spec"))
        file = path_named(named, at)
        if file in self.files:
            circle = " → ".join([*self.files[self.files.index(file) :], file])
            raise RejectedError(
                [finding("TF015", f"robots are parts of each other: {circle}", at)]
            )
        inside = replace(self, files=(*self.files, file), found=[], missing=[])
        loaded = with_includes(load_named(read(file), file), read)
        self.collected.notes.setdefault(file, []).append(_note(part))
        given = Given(part.given_args(), self.environment)
        validated = validate(
            part.laid_over(composed(loaded, part.declared.profiles, given=given)), None, given
        )
        resolved = self.resolve(validated, self.library, self.read, self.disk, inside)
        self.found += [_noted(one, part) for one in (*validated.found, *resolved.found)]
        self.found += _useless(part, file, validated)
        self.collected.allows += validated.source.allows
        self.collected.sources.append(validated.source)
        return resolved.robot


def _noted(found: Finding, part: PartEntry) -> Finding:
    return replace(found, notes=(*found.notes, _note(part)))


def _note(part: PartEntry) -> Note:
    return Note(f"as the part {part.name}", part.place)


def _useless(part: PartEntry, file: str, validated: Validated) -> list[Finding]:
    """Return a finding for each variable given to the part that it neither has nor uses."""
    given, replaced = part.declared.vars, validated.source.replaced
    known = [
        name for name in validated.spec.vars if name not in given or ("vars", name) in replaced
    ]
    found = []
    for section, name in validated.unused:
        if section == "vars" and name in given and name not in known:
            at = part.spec.at_key((*part.at, "vars", name))
            advice = did_you_mean(name, known, "remove it")
            found.append(
                finding("TF105", f"{file} does not use the variable {name}", at, help=advice)
            )
    return found
