"""``parts:`` in a robot file: another robot as a subtree, or beside others on one map."""

from __future__ import annotations

from typing import Any

from tfcompose.validate.edges import MountKeys
from tfcompose.validate.fields import ANYTHING, NAMESPACE, TEXT
from tfcompose.validate.schema import key, listing, mapping


class PartSpec(MountKeys):
    """Another robot file as a part. Everywhere else in this file its names have the prefix."""

    spec: str = key(TEXT, about="a robot file; relative to the file that names it", examples=("rover.yaml",))
    prefix: str | None = key(
        TEXT, None, "written in front of the part's frames and joints as it is; with its slash", ("robot1/",)
    )
    namespace: str | None = key(
        NAMESPACE, None, "makes the part a robot of its own, with its own static and joints; below ros.namespace"
    )
    profiles: tuple[str, ...] = key(listing(TEXT, single=True), (), "profiles of that file", (["demo"],))
    vars: dict[str, Any] = key(mapping(ANYTHING), {}, "values for variables of that file")
    root: str | None = key(TEXT, None, "only what is below this frame of the part; without the prefix")
    place: str | None = key(TEXT, None, "the pose is this frame's; the mount edge is solved for")
    owner: str | None = key(TEXT, None, "the process that publishes every edge of the part")
