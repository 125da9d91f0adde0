"""Recorded TF: MCAP and rosbag2 SQLite, read with the library rosbags, which is loaded only here; no ROS is needed."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.ros.decoder import Decoder

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.observe.census import Census
    from tfcompose.ros.decoder import Row

TF_MESSAGE = "tf2_msgs/msg/TFMessage"
#: So many topics are named where those asked for are not there.
_NAMED_AT_MOST = 12


class BagError(Exception):
    """Raised when a bag cannot be read; the message is one sentence for the user, ``help`` what to do."""

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.help = advice


class NoTopicError(BagError):
    """Raised when a bag has none of the topics."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """One TFMessage of a bag; ``rows`` is None where it cannot be decoded. ``received_ns`` is when it was recorded."""

    rows: Sequence[Row] | None
    static: bool
    received_ns: int


def missing_rosbags() -> str | None:
    """Return None when bags can be read, else one sentence that says what to install."""
    if find_spec("rosbags") is not None:
        return None
    return "bags are read with the package rosbags, which is not there: install it with pip install 'tfcompose[bag]'"


def recorded(path: str, topics: tuple[str, str]) -> Iterator[Recorded]:
    """Yield the messages of the topics (moving, fixed), in the order in which they were recorded.

    ``path`` is a bag's folder, or a single .mcap or .db3 file.

    Raises:
        NoTopicError: if it has neither of the topics.
        BagError: if it is no bag, or is damaged.
    """
    library = import_module("rosbags.rosbag2")
    bag = _bag_at(Path(path))
    decoder = Decoder()
    try:
        with library.Reader(bag) as reader:
            for connection, received_ns, data in reader.messages(connections=_of_tf(path, topics, reader.connections)):
                yield Recorded(_rows(decoder, bytes(data)), connection.topic == topics[1], received_ns)
    except BagError:
        raise
    except Exception as error:  # noqa: BLE001 (a damaged bag makes the library and its databases raise anything)
        words = " ".join(str(error).split()) or type(error).__name__
        raise BagError(f"{path} cannot be read as a bag: {words}") from None


def take_bag(path: str, censuses: Mapping[tuple[str, str], Census]) -> None:
    """Put the messages of a bag into the censuses of these topics (moving, fixed).

    Raises:
        BagError: as ``recorded`` does; topics may be missing as long as some are there.
    """
    missing = None
    for topics, census in censuses.items():
        try:
            for each in recorded(path, topics):
                if each.rows is None:
                    census.take_malformed(None)
                else:
                    census.take(each.rows, static=each.static, gid=None, received_ns=each.received_ns)
        except NoTopicError as error:
            missing = error
    if missing is not None and not any(census.messages for census in censuses.values()):
        raise missing


def _rows(decoder: Decoder, data: bytes) -> Sequence[Row] | None:
    try:
        return tuple(decoder.rows(data))
    except ValueError:
        return None


def _bag_at(path: Path) -> Path:
    """Return what the library opens.

    Raises:
        BagError: if there is nothing there, or nothing that is a bag.
    """
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    if path.is_dir() and not (path / "metadata.yaml").exists():
        files = sorted(file for file in path.iterdir() if file.suffix in {".mcap", ".db3"})
        if len(files) != 1:
            found = f"{len(files)} recordings" if files else "no recording"
            advice = "name one of the files" if files else "ros2 bag record makes a folder with metadata.yaml"
            raise BagError(f"{path} has no metadata.yaml and holds {found}", advice)
        return files[0]
    if path.is_file() and path.suffix == ".bag":
        raise BagError(f"{path} is a bag of ROS 1", "rosbags-convert makes one of ROS 2 from it")
    return path


def _of_tf(path: str, topics: tuple[str, str], connections: Sequence[Any]) -> list[Any]:
    """Return the connections of the topics.

    Raises:
        NoTopicError: if there are none; it says which TF topics the bag has instead.
    """
    wanted = [each for each in connections if each.topic in topics and each.msgtype == TF_MESSAGE]
    if wanted:
        return wanted
    others = sorted({each.topic for each in connections if each.msgtype == TF_MESSAGE})
    if others:
        names = ", ".join(others[:_NAMED_AT_MOST])
        raise NoTopicError(f"{path} has neither {' nor '.join(topics)}", f"TF is on {names}: see --namespace")
    held = ", ".join(sorted({each.topic for each in connections})[:_NAMED_AT_MOST])
    raise NoTopicError(f"{path} holds no TF", f"it holds {held}" if held else "it holds nothing")
