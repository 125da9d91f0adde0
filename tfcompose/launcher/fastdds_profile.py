"""Fast DDS profile files (XML) with partitions for the writers or readers of topics.

rmw_fastrtps uses the profile named like a topic for the topic's writers and readers. It then
ignores the default profile. So a new profile copies the file's default profile, if there is one,
and adds the partition.
"""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Literal
from xml.etree import ElementTree as ET
from xml.parsers import expat

from tfcompose.tf.ros.environment import RosError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

#: Element names of profiles of writers and readers. Older releases use the second names.
WRITERS, READERS = ("data_writer", "publisher"), ("data_reader", "subscriber")
Kind = Literal["data_writer", "data_reader"]

#: Maximum size of a profile file in bytes, and maximum depth of its elements.
MOST_BYTES = 1 << 20
DEEPEST = 100
_EMPTY = b'<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles/></dds>'
_PARTITIONS = "partitions"
#: A property of Fast DDS 2.11 and newer.
_IGNORES_ITSELF = "fastdds.ignore_local_endpoints"


def with_partitions(file: Path | None, kind: Kind, topics: Sequence[str], partitions: str) -> str:
    """Return a profile file that puts readers or writers of topics into partitions.

    The content of ``file`` is kept, except for comments. A process whose readers are in partitions
    is the guard. It ignores its own messages, because receiving them would cost as much as sending
    them.

    Raises:
        RosError: if the file cannot be read, or already puts one of the topics into a partition.
    """
    root = _read(file)
    profiles = root if root.tag == "profiles" else root.find("profiles")
    if profiles is None:
        if root.tag != "dds":
            raise RosError(f"it begins with <{root.tag}>, not with <dds>")
        profiles = ET.SubElement(root, "profiles")
    names = WRITERS if kind == "data_writer" else READERS
    elements = [element for element in root.iter() if element.tag in names]
    default = next(
        (element for element in elements if element.get("is_default_profile") == "true"), None
    )
    for topic in dict.fromkeys(topics):
        profile = next(
            (element for element in elements if element.get("profile_name") == topic), None
        )
        if profile is None:
            profile = ET.Element(kind) if default is None else deepcopy(default)
            profile.attrib.pop("is_default_profile", None)
            profile.set("profile_name", topic)
            profiles.append(profile)
        if _has_property(profile, _PARTITIONS):
            raise RosError(f"it puts {topic} into a partition itself")
        _add_property(profile, _PARTITIONS, partitions)
    if kind == "data_reader":
        _ignore_own_writers(profiles)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _ignore_own_writers(profiles: ET.Element) -> None:
    """Prevent the process's readers from matching its own writers."""
    participant = next(
        (
            element
            for element in profiles.iter("participant")
            if element.get("is_default_profile") == "true"
        ),
        None,
    )
    if participant is None:
        attributes = {"profile_name": "tfcompose", "is_default_profile": "true"}
        participant = ET.SubElement(profiles, "participant", attributes)
    rtps = _below(participant, "rtps")
    if not _has_property(rtps, _IGNORES_ITSELF):
        _add_property(rtps, _IGNORES_ITSELF, "true")


def _has_property(entity: ET.Element, name: str) -> bool:
    properties = _below(_below(entity, "propertiesPolicy"), "properties")
    return any((element.findtext("name") or "").strip() == name for element in properties)


def _add_property(entity: ET.Element, name: str, value: str) -> None:
    added = ET.SubElement(_below(_below(entity, "propertiesPolicy"), "properties"), "property")
    ET.SubElement(added, "name").text = name
    ET.SubElement(added, "value").text = value


def _below(parent: ET.Element, name: str) -> ET.Element:
    element = parent.find(name)
    return ET.SubElement(parent, name) if element is None else element


def _read(file: Path | None) -> ET.Element:
    if file is None:
        return _ProfileReader().read(_EMPTY)
    try:
        if not file.is_file():
            raise RosError("it is not a regular file" if file.exists() else "it does not exist")
        with file.open("rb") as opened:
            data = opened.read(MOST_BYTES + 1)
    except OSError as error:
        raise RosError(f"it cannot be read: {error.strerror}") from None
    if len(data) > MOST_BYTES:
        raise RosError(f"it is longer than {MOST_BYTES >> 20} MiB")
    try:
        return _ProfileReader().read(data)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise RosError(f"it cannot be read: {error}") from None


class _ProfileReader:
    """Reads XML as Fast DDS does, without XML namespaces.

    Raises:
        ValueError: with a sentence, for a document type or elements nested too deep.
        expat.ExpatError: if the text is not XML.
    """

    def __init__(self) -> None:
        self._builder = ET.TreeBuilder()
        self._depth = 0
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._builder.data
        self._parser.StartDoctypeDeclHandler = self._refuse

    def read(self, data: bytes) -> ET.Element:
        self._parser.Parse(data, True)  # noqa: FBT003 (expat's: this is all)
        return self._builder.close()

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError(f"its elements are nested more than {DEEPEST} deep")
        self._builder.start(name, attributes)

    def _end(self, name: str) -> None:
        self._depth -= 1
        self._builder.end(name)

    def _refuse(self, *_: object) -> None:
        raise ValueError("it declares a document type, which no profile needs")
