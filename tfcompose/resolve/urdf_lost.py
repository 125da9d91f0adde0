"""What a URDF says that a robot file has no place for: each link's and joint's, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.geometry import normalised, quat_from_rpy
from tfcompose.urdf.schema import OPAQUE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tfcompose.findings import Finding, Span
    from tfcompose.geometry import Quaternion, Vector
    from tfcompose.imported import Entry
    from tfcompose.model import Robot
    from tfcompose.urdf.read import Element

#: Known attributes that nothing here holds.
_NOT_HELD = {
    "link": ("type",),
    "visual": ("name",),
    "collision": ("name",),
    "limit": ("acceleration", "jerk", "deceleration"),
    "calibration": ("reference_position",),
}
#: Of files, for which nothing is left out; and of blocks, which say it themselves.
_SAID_ELSEWHERE = frozenset({"TF203", "TF703", "TF723", "TF724"})
#: What says nothing in a joint that does not move.
_OF_MOTION = ("axis", "limit", "mimic", "dynamics", "calibration", "safety_controller")


def lost(root: Element, robot: Robot, found: Iterable[Finding]) -> dict[Entry, list[str]]:
    """Return what is left out of each link and joint, ``found`` by reading included; of the whole under no name."""
    notes: dict[Entry, list[str]] = {}
    entries: list[tuple[Span, Entry]] = []
    colours = _described(root)
    for element in root.children:
        if element.tag not in {"link", "joint"}:
            continue
        at = (f"{element.tag}s", element.attributes.get("name", ""))
        entries.append((element.at, at))
        several = list(dict.fromkeys(_in_element(element, colours)))
        if several:
            notes.setdefault(at, []).append(f"left out: {', '.join(several)}")
        if _has_no_ends(element):
            notes.setdefault(at, []).append("the source says no lower and upper limit, and readers take 0")
    for one in found:
        if one.span and one.code not in _SAID_ELSEWHERE:
            notes.setdefault(_entry_at(one.span, entries), []).append(f"{one.code} in the source: {one.message}")
    whole = list(_in_whole(root, robot))
    if whole:
        notes.setdefault(("", ""), []).append(f"left out: {', '.join(whole)}")
    return notes


def _has_no_ends(element: Element) -> bool:
    limit = element.first("limit") if element.attributes.get("type") in {"revolute", "prismatic"} else None
    return limit is not None and not limit.attributes.keys() & {"lower", "upper"}


def _entry_at(span: Span, entries: list[tuple[Span, Entry]]) -> Entry:
    before = [at for place, at in entries if (place.line, place.column) <= (span.line, span.column)]
    return before[-1] if before else ("", "")


def _in_whole(root: Element, robot: Robot) -> Iterator[str]:
    for name in root.attributes:
        if name != "name" and not name.startswith("xmlns"):
            yield f'{name}="{root.attributes[name]}"'
    known = {shape.material.name for link in robot.links.values() for shape in link.visuals if shape.material}
    unused = [name for one in root.all("material") if (name := one.attributes.get("name", "")) not in known]
    if unused:
        yield f"{'materials' if unused[1:] else 'the material'} {', '.join(unused)}, which nothing has"


def _in_element(element: Element, colours: frozenset[str]) -> Iterator[str]:
    """Yield what is in a link or joint and has no place."""
    kind = element.attributes.get("type", "") if element.tag == "joint" else ""
    if kind == "fixed":
        words = [child.tag for child in element.children if child.tag in _OF_MOTION]
        yield from (f"the {word} of a joint that does not move" for word in words)
    for one in _within(element):
        yield from _in_attributes(one)
        yield from (f"<{child.tag}>" for child in one.children if ":" in child.tag)
        if one.tag == "material" and one.attributes.get("name") not in colours and not one.children:
            yield f"the material {one.attributes.get('name', '')}, which nothing describes"


def _in_attributes(element: Element) -> Iterator[str]:
    for name, value in element.attributes.items():
        if ":" in name or name in _NOT_HELD.get(element.tag, ()):
            yield f'{element.tag} {name}="{value}"'


def _described(root: Element) -> frozenset[str]:
    """Return the names of the materials that have a colour or a texture somewhere."""
    visuals = [one for link in root.all("link") for one in link.all("visual")]
    several = [said for around in (root, *visuals) for said in around.all("material")]
    return frozenset(said.attributes.get("name", "") for said in several if said.children)


def _within(element: Element) -> Iterator[Element]:
    waiting = [element]
    while waiting:
        one = waiting.pop()
        yield one
        waiting += [child for child in one.children if child.tag not in OPAQUE and ":" not in child.tag]


def angles(root: Element) -> dict[Quaternion, Vector]:
    """Return roll, pitch and yaw (rad) of each origin as they are written, by the rotation that they are."""
    written: dict[Quaternion, Vector] = {}
    for top in root.children:
        for one in _within(top) if top.tag in {"link", "joint"} else ():
            words = one.attributes.get("rpy", "").split() if one.tag == "origin" else []
            try:
                roll, pitch, yaw = map(float, words)
            except ValueError:
                continue
            if max(map(abs, (roll, pitch, yaw))) < 1e9:  # noqa: PLR2004 (as where poses are read)
                written.setdefault(normalised(quat_from_rpy(roll, pitch, yaw)), (roll, pitch, yaw))
    return written
