"""Recorded TF: MCAP and rosbag2 SQLite files, read with rosbags, without ROS."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib.util import find_spec
from pathlib import Path
from struct import Struct
from typing import TYPE_CHECKING, Any, NamedTuple

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.reading import exists, is_file, is_folder, names_in
from tfcompose.model.plan.topics import namespace_options
from tfcompose.tf.live.edges import nearer_clock
from tfcompose.tf.live.pose_query import NoPose
from tfcompose.tf.ros.tf_codec import TF_MESSAGE, TF_MESSAGE_HASH, Decoder
from tfcompose.tf.tf2 import Buffer, TransformException
from tfcompose.tf.tf2.pose_buffer import CACHE_NS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
    from datetime import date

    from typing_extensions import Self

    from tfcompose.foundation.geometry import Pose
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.live.pose_query import OnPose, PoseQuery
    from tfcompose.tf.ros.tf_codec import Row

    Topics = tuple[str, str]
    Rewrite = Callable[[Iterator["RecordedMessage"]], Iterator["RecordedMessage"]]

CLOCK = "rosgraph_msgs/msg/Clock"
#: A time as CDR: after a header of four bytes, seconds and nanoseconds.
_CLOCK, _CLOCK_BYTES = Struct("<iI"), 12
_SECOND_NS = 1_000_000_000
ENDINGS = {".mcap", ".db3"}
#: The languages of MCAP's message definitions that are not ROS 2's (MCAP's registry).
_FOREIGN = frozenset({"flatbuffer", "jsonschema", "omgidl", "protobuf", "ros1msg"})
#: Maximum number of topics that an error lists if the requested topics are missing.
_NAMED_AT_MOST = 12


class BagError(Exception):
    """A bag cannot be read.

    The message is a sentence for the user; ``help`` is the advice.
    """

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.help = advice


@dataclass(frozen=True, slots=True)
class RecordedMessage:
    """A TFMessage from a bag."""

    #: The pair of topics (moving, fixed) that includes the message's topic.
    topics: Topics
    #: The transforms, None for an undecodable message.
    rows: Sequence[Row] | None
    #: Whether it is on the topic of fixed edges.
    static: bool
    #: Time of the recording, in nanoseconds since the epoch.
    received_ns: int
    #: The newest time on /clock at that time, None without a recorded /clock.
    clock_ns: int | None = None


def missing_rosbags() -> str | None:
    """Return a sentence that tells what to install, None if bags can be read."""
    if find_spec("rosbags") is not None:
        return None
    return (
        "bags are read with the package rosbags, which is not there: install it with pip install"
        " 'tfcompose[bag]'"
    )


class TypedMessage(NamedTuple):
    """A message of any type, as bytes."""

    topic: str
    #: The type as in the ROS graph: ``sensor_msgs/msg/Imu``.
    type: str
    data: bytes


class Recording:
    """A bag: a folder, or a single .mcap or .db3 file.

    If a folder has no metadata.yaml, its files are read one by one. ``end_ns`` is the time of the
    last message on any topic, and 0 until that message has been read.

    Raises:
        BagError: if there is no bag.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self.end_ns = 0
        self._files = _files_at(Path(path))
        self._clock_ns: int | None = None

    def first_day(self) -> date | None:
        """Return the day of the first message in UTC, None for a bag without messages.

        Raises:
            BagError: if it is not a bag, or is damaged.
        """
        from rosbags.rosbag2 import Reader  # noqa: PLC0415 (it is optional)

        for file in self._files:
            try:
                with Reader(file) as reader:
                    if reader.message_count:
                        return datetime.fromtimestamp(
                            reader.start_time // _SECOND_NS, timezone.utc
                        ).date()
            except Exception as error:  # noqa: BLE001 (as for messages)
                raise damage_error(str(file), error) from None
        return None

    def messages(self, *pairs: Topics) -> Iterator[RecordedMessage]:
        """Yield the messages of the pairs of topics (moving, fixed) in recorded order.

        Raises:
            BagError: if the bag has none of the topics, is not a bag, is damaged, or its messages
                have another type.
        """
        from rosbags.rosbag2 import Reader  # noqa: PLC0415 (it is optional)

        decoder = Decoder()
        pair_of = {topic: pair for pair in pairs for topic in pair}
        recorded: set[tuple[str, str]] = set()
        has_any = False
        for file in self._files:
            try:
                with Reader(file) as reader:
                    tf_connections = [each for each in reader.connections if _is_tf(each, pair_of)]
                    recorded |= {(each.topic, each.msgtype) for each in reader.connections}
                    has_any = has_any or bool(tf_connections)
                    self.end_ns = (
                        max(self.end_ns, reader.end_time) if reader.message_count else self.end_ns
                    )
                    for connection, received_ns, data in self._with_clock(reader, tf_connections):
                        pair = pair_of[connection.topic]
                        rows = _rows(decoder, bytes(data))
                        yield RecordedMessage(
                            pair, rows, connection.topic == pair[1], received_ns, self._clock_ns
                        )
            except BagError:
                raise
            except Exception as error:  # noqa: BLE001 (a damaged bag makes the library and its databases raise anything)
                raise damage_error(str(file), error) from None
        if not has_any:
            raise _no_topic(self.path, pairs, recorded)

    def messages_of_types(self, types: Collection[str]) -> Iterator[TypedMessage]:
        """Yield the messages of these types on all topics, in recorded order.

        Raises:
            BagError: if it is not a bag, or is damaged.
        """
        from rosbags.rosbag2 import Reader  # noqa: PLC0415 (it is optional)

        for file in self._files:
            try:
                with Reader(file) as reader:
                    connections = [each for each in reader.connections if each.msgtype in types]
                    if not connections:
                        continue
                    for connection, _, data in reader.messages(connections=connections):
                        yield TypedMessage(connection.topic, connection.msgtype, bytes(data))
            except Exception as error:  # noqa: BLE001 (a damaged bag makes the library and its databases raise anything)
                raise damage_error(str(file), error) from None

    def _with_clock(self, reader: Any, connections: list[Any]) -> Iterator[tuple[Any, int, bytes]]:
        """Yield the messages of these connections.

        Record the time from /clock between the messages.
        """
        clocks = [
            each for each in reader.connections if (each.topic, each.msgtype) == ("/clock", CLOCK)
        ]
        if not connections:
            return
        for connection, received_ns, data in reader.messages(connections=[*connections, *clocks]):
            if connection not in clocks:
                yield connection, received_ns, data
            elif len(data) >= _CLOCK_BYTES:
                seconds, nanoseconds = _CLOCK.unpack_from(data, 4)
                self._clock_ns = seconds * _SECOND_NS + nanoseconds


class BagFeed:
    """Feeds the messages of a bag to the observers of pairs of topics (moving, fixed).

    The bag must have at least one of the topics. ``rewrite`` returns the messages that replace the
    recorded messages.

    Raises:
        BagError: if there is no bag.
    """

    def __init__(
        self, path: str, observers: Mapping[Topics, TreeObserver], rewrite: Rewrite = iter
    ) -> None:
        self._recording = Recording(path)
        self._observers = observers
        self._rewrite = rewrite

    def __enter__(self) -> Self:
        """Begin; files are opened as they are read."""
        return self

    def __exit__(self, *_: object) -> None:
        """End."""

    def take(self, timeout_s: float, stop: Stop) -> bool:
        """Pass the entire bag to the observers, and record its end.

        Return False, because there are no more messages.

        Raises:
            BagError: if the bag cannot be read.
        """
        del timeout_s
        for each in self._rewrite(self._recording.messages(*self._observers)):
            observer = self._observers[each.topics]
            if each.rows is None:
                observer.take_malformed(None)
            else:
                clock_ns = nearer_clock(
                    each.rows, each.received_ns, each.clock_ns, static=each.static
                )
                observer.take(
                    each.rows,
                    static=each.static,
                    gid=None,
                    received_ns=each.received_ns,
                    clock_ns=clock_ns,
                )
            if stop.requested:
                break
        for observer in self._observers.values():
            observer.end_ns = self._recording.end_ns
        return False

    def elsewhere(self) -> tuple[str, ...]:
        """Return no topics. A bag with TF only on other topics raises an error that names them."""
        return ()


def echo_bag(path: str, query: PoseQuery, on_pose: OnPose) -> NoPose | None:
    """Pass poses from a bag to ``on_pose`` in recorded order.

    With ``once``, this is the first pose. With an ``at_ns`` other than 0, it is the pose at that
    time. Otherwise there are ``rate`` poses for each second of the recording. Return None if there
    was a pose, otherwise the reason.

    Raises:
        BagError: if the bag cannot be read.
    """
    replay = _Replay(query, on_pose)
    for each in Recording(path).messages(query.topics):
        if each.rows is None:
            continue
        replay.take(each.rows, static=each.static)
        if replay.is_done(each.received_ns):
            return None
        # The buffer drops old samples. Later it could only report that the time is too old.
        if 0 < query.at_ns < replay.newest_ns - CACHE_NS // 2:
            break
    return replay.explain_end()


class _Replay:
    """The buffer during the replay of a recording, and the poses passed on so far."""

    def __init__(self, query: PoseQuery, on_pose: OnPose) -> None:
        self.newest_ns = 0
        self._buffer = Buffer()
        self._query = query
        self._on_pose = on_pose
        self._next_ns = 0
        self._given_ns: int | None = None
        self._gave = False

    def take(self, rows: Iterable[Row], *, static: bool) -> None:
        rows = tuple(rows)
        self._buffer.insert(rows, static=static)
        if not static:
            self.newest_ns = max(
                self.newest_ns, *(row[2] * _SECOND_NS + row[3] for row in rows), 0
            )

    def is_done(self, now_ns: int) -> bool:
        """Pass on the pose if it is due. Return whether it was the last."""
        query = self._query
        if query.at_ns < 0 or now_ns < self._next_ns:
            return False
        try:
            pose, stamp_ns = query.pose_in(self._buffer)
        except TransformException:
            return False
        if self._gave and stamp_ns == self._given_ns:
            return False
        self._give(pose, stamp_ns)
        self._next_ns = now_ns + int(_SECOND_NS / query.rate)
        return query.once or query.at_ns > 0

    def explain_end(self) -> NoPose | None:
        """Return None if a pose was passed on, otherwise the reason."""
        if self._gave:
            return None
        try:
            self._give(*self._query.pose_in(self._buffer))
        except TransformException as error:
            return NoPose(str(error.detail))
        return None

    def _give(self, pose: Pose, stamp_ns: int | None) -> None:
        self._gave, self._given_ns = True, stamp_ns
        self._on_pose(pose, stamp_ns)


def _rows(decoder: Decoder, data: bytes) -> Sequence[Row] | None:
    try:
        return tuple(decoder.rows(data))
    except ValueError:
        return None


def _is_tf(connection: Any, topics: Mapping[str, Topics]) -> bool:
    """Return whether the connection is a requested topic with TF.

    Raises:
        BagError: if its topic has a TF name but another type.
    """
    if connection.topic not in topics or connection.msgtype != TF_MESSAGE:
        return False
    if connection.digest.startswith("RIHS01_") and connection.digest != TF_MESSAGE_HASH:
        message = (
            f"{connection.topic} was recorded with another definition of {TF_MESSAGE} than ROS"
            " 2 has"
        )
        raise BagError(
            message,
            "was it recorded with a changed tf2_msgs or geometry_msgs? Only the common one is"
            " read",
        )
    return True


def _no_topic(path: str, pairs: Sequence[Topics], held: set[tuple[str, str]]) -> BagError:
    """Return the error for a bag without the topics, which names the bag's TF topics."""
    requested = [topic for pair in pairs for topic in pair]
    for topic, type_ in sorted(held):
        if topic in requested:
            return BagError(f"{topic} in {path} is {type_}, not {TF_MESSAGE}", _help_of(type_))
    tf_topics = sorted(topic for topic, type_ in held if type_ == TF_MESSAGE)
    if tf_topics:
        names = ", ".join(tf_topics[:_NAMED_AT_MOST])
        return BagError(
            f"{path} has neither {' nor '.join(requested)}",
            f"TF is on {names}: {namespace_options(tf_topics)}",
        )
    names = ", ".join(sorted({topic for topic, _ in held})[:_NAMED_AT_MOST])
    return BagError(f"{path} holds no TF", f"it holds {names}" if names else "it is empty")


def _help_of(type_: str) -> str:
    return (
        "rosbags-convert makes ROS 2's of ROS 1's"
        if type_.endswith("/tfMessage") or "/msg/" not in type_
        else ""
    )


def _files_at(path: Path) -> list[Path]:
    """Return the files to read, in order.

    The path is a folder with metadata, a single file, or a folder with files.

    Raises:
        BagError: if the path does not exist or is not a bag.
    """
    if path.name == "metadata.yaml":
        path = path.parent
    if not exists(path):
        raise BagError(f"{path} does not exist")
    if is_folder(path):
        if is_file(path / "metadata.yaml"):
            return [path]
        try:
            entries = [path / name for name in names_in(path)]
        except RejectedError as error:
            raise BagError(f"{path} {error.findings[0].message}") from None
        files = sorted((file for file in entries if file.suffix in ENDINGS), key=_in_order)
        if not files:
            advice = "name the folder that ros2 bag record wrote; it has a metadata.yaml"
            raise BagError(f"{path} has no metadata.yaml and holds no recording", advice)
        return files
    if path.suffix == ".bag":
        raise BagError(f"{path} is a bag of ROS 1", "convert it to ROS 2 with rosbags-convert")
    if path.suffix in {".zstd", ".zst"}:
        raise BagError(
            f"{path} is a file that is compressed as a whole",
            "name its folder, which has metadata.yaml, or decompress it first: unzstd FILE",
        )
    if path.suffix not in ENDINGS:
        raise BagError(
            f"{path} is not a recording: those end in .mcap or .db3",
            "name such a file or its folder",
        )
    return [path]


def _in_order(file: Path) -> list[tuple[int, str]]:
    """Return a sort key that compares the numbers in names, as in the parts of a split bag."""
    return [_order_of(part) for part in re.split(r"(\d+)", file.name)]


def _order_of(part: str) -> tuple[int, str]:
    return (int(part), "") if part.isdigit() else (-1, part)


def damage_error(path: str, error: Exception) -> BagError:
    """Return the error for a bag that the library cannot read."""
    reason = " ".join(str(error).split()) or type(error).__name__
    advice = ""
    if "end magic" in reason:
        reason = "it ends in the middle, as when the recorder was killed"
        advice = "mcap recover FILE -o WHOLE.mcap keeps what is whole in it"
    elif isinstance(error, KeyError) and error.args[0] in _FOREIGN:
        reason = f"it has messages in {error.args[0]}; only those of ROS 2 can be read"
        advice = "mcap filter FILE --exclude-topic-regex TOPIC -o OTHERS.mcap leaves them out"
    elif (
        _is_mcap(Path(path))
        and not isinstance(error, OSError)
        and not type(error).__module__.startswith("rosbags")
    ):
        reason = (  # errors that rosbags does not expect, such as a huge size
            f"it is damaged ({reason})"
        )
        advice = "mcap recover FILE -o WHOLE.mcap keeps what is whole in it"
    elif "malformed" in reason or "missing tables" in reason or "not a database" in reason:
        advice = "sqlite3 FILE .recover | sqlite3 WHOLE.db3 keeps what is whole in it"
    elif "metadata" in reason or "database files are missing" in reason:
        advice = "ros2 bag reindex writes metadata.yaml anew; or name a recording in the folder"
    return BagError(f"{path} cannot be read as a bag: {reason}", advice)


def _is_mcap(path: Path) -> bool:
    names = names_in(path) if is_folder(path) else [path.name]
    return any(name.endswith(".mcap") for name in names)
