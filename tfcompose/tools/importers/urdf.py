"""Import of a robot_state_publisher's description: a part for xacro, links for URDF."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.lint import read_urdf
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.plan.stock import STATE_PUBLISHER
from tfcompose.tools.importers.draft import path_from, where
from tfcompose.tools.importers.launch_records import PACKAGE
from tfcompose.tools.importers.robot_file import import_document, put_into

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tfcompose.compiler.resolve import Library
    from tfcompose.model.files import Target
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.program import Description

_OUTSIDE = "--package NAME=FOLDER names its package; --trust is for files of your own"
#: The file name in findings about the text of a description.
_TEXT = "robot_description.urdf"


@dataclass(frozen=True, slots=True)
class ImportContext:
    """Packages, folders that the user names, and presets (None to recognise no sensors)."""

    packages: Packages
    target: Target
    library: Library | None
    folders: Mapping[str, str] = field(default_factory=dict)


def add_descriptions(
    draft: ImportDraft, descriptions: Iterable[Description], context: ImportContext
) -> None:
    """Add the descriptions of robot_state_publishers.

    The first URDF becomes links. A comment names each further URDF.
    """
    for described in descriptions:
        if draft.is_adopted:
            _add_external_part(draft, described, context)
        elif described.file and not described.file.endswith(".urdf"):
            _add_part(draft, described, context)
        elif draft.sections["links"]:
            draft.todo(
                "a second robot_state_publisher with a URDF",
                described.span,
                advice="parts: {NAME: {urdf: FILE}}",
            )
        else:
            _add_links(draft, described, context)


def _add_external_part(draft: ImportDraft, described: Description, context: ImportContext) -> None:
    """Add a description as a part whose edges robot_state_publisher continues to publish."""
    if described.file.endswith(".xacro"):
        _add_part(draft, described, context)
        part = next(reversed(draft.sections["parts"]))
    else:
        part = draft.robot
        file = described.file or f"{draft.robot}.urdf"
        if described.text:
            draft.neighbours[file] = described.text
        address = file if described.text else path_from(context.target, file)
        prefix = {"prefix": described.prefix} if described.prefix else {}
        draft.sections["parts"][part] = {"urdf": address, **prefix}
        draft.note(("parts", part), where(described.span, "what robot_state_publisher is given"))
        draft.has_unknown_frames = True
    draft.publishers[part] = described.span
    owner = draft.process(STATE_PUBLISHER, {"external": True}, where(described.span))
    draft.sections["parts"][part]["owner"] = owner


def _add_part(draft: ImportDraft, described: Description, context: ImportContext) -> None:
    path = described.file
    around = (
        (name, folder)
        for name, folder in context.folders.items()
        if path.startswith(folder.rstrip("/") + "/")
    )
    package, folder = next(around, ("", ""))
    if package:
        address = f"{PACKAGE}{package}/{posixpath.relpath(path, folder)}"
        draft.sections["packages"][package] = context.target.from_folder(folder)
    elif installed := _installed_path(path, context.packages):
        address = installed
    else:
        address = path if path.startswith(PACKAGE) else path_from(context.target, path)
    keys = {"xacro": address}
    keys |= {"args": dict(described.args)} if described.args else {}  # type: ignore[dict-item]
    keys |= {"prefix": described.prefix} if described.prefix else {}
    draft.has_unknown_frames = True
    name = posixpath.basename(path).partition(".")[0].replace("-", "_") or "robot"
    draft.sections["parts"][name] = keys
    draft.note(("parts", name), where(described.span, "what robot_state_publisher is given"))


def _installed_path(path: str, packages: Packages) -> str:
    """Return the ``package://`` address of a file in an installed package; empty for others."""
    for prefix in packages.disk.prefixes if packages.disk else ():
        share = prefix.rstrip("/") + "/share/"
        if path.startswith(share) and path.count("/", len(share)):
            return PACKAGE + path.removeprefix(share)
    return ""


def _add_links(draft: ImportDraft, described: Description, context: ImportContext) -> None:
    packages, file = context.packages, described.file
    if described.text and packages.disk:
        text = described.text
        packages_of_text = replace(packages.disk, read=lambda _: text)
        packages, file = Packages(packages_of_text, packages.named, packages.advice), _TEXT
    elif file.startswith(PACKAGE):
        draft.todo(f"the description {file}: its package was not found", described.span)
        return
    elif not draft.reach.allows(file):
        draft.todo(
            f"the description {file}: reading it is not allowed", described.span, advice=_OUTSIDE
        )
        return
    try:
        document = read_urdf(file, packages)
    except RejectedError as error:
        draft.todo(f"the description: {error.findings[0].message}", described.span)
        return
    for finding in document.findings():
        if finding.severity == "error":
            draft.todo(f"the description has {finding.code}: {finding.message}", described.span)
    robot = import_document(document, context.target, draft.robot, packages.local, context.library)
    if described.prefix:
        draft.sections["ros"]["frame_prefix"] = described.prefix
    put_into(draft, robot)
