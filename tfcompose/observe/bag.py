"""Recorded TF: MCAP and rosbag2 SQLite, read with the library rosbags, which is loaded only here; no ROS is needed."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING, Any

from tfcompose.observe.bag_files import BagError, damaged, files_at
from tfcompose.observe.census import nearer_clock
from tfcompose.observe.elsewhere import namespace_words
from tfcompose.ros.tf_codec import TF_MESSAGE, TF_MESSAGE_HASH, Decoder

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.observe.census import Census
    from tfcompose.ros.tf_codec import Row

    Topics = tuple[str, str]

CLOCK = "rosgraph_msgs/msg/Clock"
#: In CDR: four bytes of header, then seconds and nanoseconds.
_CLOCK, _CLOCK_BYTES = Struct("<iI"), 12
#: So many topics are named where those asked for are not there.
_NAMED_AT_MOST = 12


@dataclass(frozen=True, slots=True)
class Recorded:
    """One TFMessage of a bag, on one of the ``topics`` (moving, fixed); ``rows`` is None where it cannot be decoded.

    ``received_ns`` is when it was recorded, ``clock_ns`` the newest time on /clock then, None where none was recorded.
    """

    topics: Topics
    rows: Sequence[Row] | None
    static: bool
    received_ns: int
    clock_ns: int | None = None


def missing_rosbags() -> str | None:
    """Return None when bags can be read, else one sentence that says what to install."""
    if find_spec("rosbags") is not None:
        return None
    return "bags are read with the package rosbags, which is not there: install it with pip install 'tfcompose[bag]'"


class Recording:
    """A bag: a folder, or a single .mcap or .db3 file; a folder without metadata.yaml is read file by file.

    ``end_ns`` is when the last message of any topic was recorded, 0 before it was read.

    Raises:
        BagError: if there is none.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self.end_ns = 0
        self._files = files_at(Path(path))
        self._clock_ns: int | None = None

    def messages(self, *pairs: Topics) -> Iterator[Recorded]:
        """Yield the messages of the pairs of topics (moving, fixed), in the order in which they were recorded.

        Raises:
            BagError: if it has none of the topics, is no bag, is damaged, or its messages are not TF's.
        """
        library = import_module("rosbags.rosbag2")
        decoder = Decoder()
        pair_of = {topic: pair for pair in pairs for topic in pair}
        others: set[tuple[str, str]] = set()
        found = False
        for file in self._files:
            try:
                with library.Reader(file) as reader:
                    wanted = [each for each in reader.connections if _is_tf(each, pair_of)]
                    others |= {(each.topic, each.msgtype) for each in reader.connections}
                    found = found or bool(wanted)
                    self.end_ns = max(self.end_ns, reader.end_time) if reader.message_count else self.end_ns
                    for connection, received_ns, data in self._timed(reader, wanted):
                        pair = pair_of[connection.topic]
                        rows = _rows(decoder, bytes(data))
                        yield Recorded(pair, rows, connection.topic == pair[1], received_ns, self._clock_ns)
            except BagError:
                raise
            except Exception as error:  # noqa: BLE001 (a damaged bag makes the library and its databases raise anything)
                raise damaged(str(file), error) from None
        if not found:
            raise _no_topic(self.path, pairs, others)

    def _timed(self, reader: Any, wanted: list[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """Yield the messages of these connections, and note what comes on /clock between them."""
        clocks = [each for each in reader.connections if (each.topic, each.msgtype) == ("/clock", CLOCK)]
        if not wanted:
            return
        for connection, received_ns, data in reader.messages(connections=[*wanted, *clocks]):
            if connection not in clocks:
                yield connection, received_ns, data
            elif len(data) >= _CLOCK_BYTES:
                seconds, nanoseconds = _CLOCK.unpack_from(data, 4)
                self._clock_ns = seconds * 1_000_000_000 + nanoseconds


def take_bag(path: str, censuses: Mapping[Topics, Census]) -> None:
    """Put the messages of a bag into the censuses of these topics (moving, fixed), and note when it ends.

    Raises:
        BagError: as ``Recording`` does; topics may be missing as long as some are there.
    """
    recording = Recording(path)
    for each in recording.messages(*censuses):
        census = censuses[each.topics]
        if each.rows is None:
            census.take_malformed(None)
        else:
            clock_ns = nearer_clock(each.rows, each.received_ns, each.clock_ns, static=each.static)
            census.take(each.rows, static=each.static, gid=None, received_ns=each.received_ns, clock_ns=clock_ns)
    for census in censuses.values():
        census.end_ns = recording.end_ns


def _rows(decoder: Decoder, data: bytes) -> Sequence[Row] | None:
    try:
        return tuple(decoder.rows(data))
    except ValueError:
        return None


def _is_tf(connection: Any, wanted: Mapping[str, Topics]) -> bool:
    """Whether the connection is a wanted topic with TF.

    Raises:
        BagError: if its messages are named as TF's and hold something else.
    """
    if connection.topic not in wanted or connection.msgtype != TF_MESSAGE:
        return False
    if connection.digest.startswith("RIHS01_") and connection.digest != TF_MESSAGE_HASH:
        message = f"{connection.topic} was recorded with another definition of {TF_MESSAGE} than ROS 2 has"
        raise BagError(message, "was it recorded with a changed tf2_msgs or geometry_msgs? Only the common one is read")
    return True


def _no_topic(path: str, pairs: Sequence[Topics], held: set[tuple[str, str]]) -> BagError:
    """Return what to say where none of the topics is: which TF topics the bag has instead."""
    asked = [topic for pair in pairs for topic in pair]
    for topic, type_ in sorted(held):
        if topic in asked:
            return BagError(f"{topic} in {path} is {type_}, not {TF_MESSAGE}", _help_of(type_))
    others = sorted(topic for topic, type_ in held if type_ == TF_MESSAGE)
    if others:
        names = ", ".join(others[:_NAMED_AT_MOST])
        return BagError(f"{path} has neither {' nor '.join(asked)}", f"TF is on {names}: {namespace_words(others)}")
    names = ", ".join(sorted({topic for topic, _ in held})[:_NAMED_AT_MOST])
    return BagError(f"{path} holds no TF", f"it holds {names}" if names else "it holds nothing")


def _help_of(type_: str) -> str:
    return "rosbags-convert makes ROS 2's of ROS 1's" if type_.endswith("/tfMessage") or "/msg/" not in type_ else ""
