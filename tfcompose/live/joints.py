"""The moving joints of a robot's description, as a listener reads it."""

from __future__ import annotations

from xml.parsers import expat

from tfcompose.live.state import MovingJoint

#: Joints that a state moves.
MOVING = frozenset({"revolute", "continuous", "prismatic"})


class _Reader:
    """Reads the joints of a URDF; a document that declares a type or entities is not read on."""

    def __init__(self) -> None:
        self.joints: list[MovingJoint] = []
        self._depth = 0
        self._joint: dict[str, str] = {}
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse

    def read(self, text: str) -> None:
        try:
            self._parser.Parse(text, True)  # noqa: FBT003 (expat's: this is all)
        except (expat.ExpatError, ValueError):
            self.joints.clear()

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth == 2 and name == "joint":  # noqa: PLR2004 (below <robot>)
            self._joint = {"name": attributes.get("name", ""), "type": attributes.get("type", "")}
        elif name in {"parent", "child"} and self._joint:
            self._joint[name] = attributes.get("link", "")
        elif name == "mimic" and self._joint:
            self._joint["mimic"] = "yes"

    def _end(self, name: str) -> None:
        if self._depth == 2 and name == "joint" and self._joint.get("type") in MOVING:  # noqa: PLR2004
            joint = self._joint
            self.joints.append(
                MovingJoint(joint["name"], joint.get("parent", ""), joint.get("child", ""), "mimic" in joint)
            )
        if self._depth == 2:  # noqa: PLR2004
            self._joint = {}
        self._depth -= 1

    def _refuse(self, *_: object) -> None:
        raise ValueError


def joints_of(description: str) -> tuple[MovingJoint, ...]:
    """Return the moving joints of a URDF; none where it is none."""
    reader = _Reader()
    reader.read(description)
    return tuple(reader.joints)
