"""Rewriting of an MCAP file, record by record, with the library ``mcap``."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from mcap.reader import make_reader
from mcap.records import Attachment, Chunk, DataEnd, Header, Message, Metadata, Schema
from mcap.records import Channel as ChannelRecord
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from tfcompose.tools.rebag.recorded_topic import TF_HASH, RecordedTopic

if TYPE_CHECKING:
    from pathlib import Path
    from typing import BinaryIO

    from mcap.summary import Summary

    from tfcompose.tools.rebag.rewriting import Edit, Rewrite

#: The metadata record in which rosbag2 keeps a copy of metadata.yaml, and the key in it.
_ROSBAG2, _SERIALIZED = "rosbag2", "serialized_metadata"
#: The name of tfcompose's metadata record.
PROVENANCE = "tfcompose"
_COMPRESSION = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}


def rewrite_mcap(source: Path, target: Path, rewrite: Rewrite) -> Counter[str]:
    """Write the corrected copy of an MCAP file, and return the number of messages by topic.

    The copy has the source's chunk size and compression. Messages keep their order, times and
    sequence numbers.

    Raises:
        McapError: if the source is damaged.
        OSError: if a file cannot be read or written.
    """
    with source.open("rb") as old, target.open("wb") as new:
        summary = make_reader(old).get_summary()
        old.seek(0)
        writer = _writer_like(old, new)
        old.seek(0)
        file = _McapRewrite(rewrite, writer, summary)
        for record in StreamReader(old).records:
            rewrite.go_on()
            if isinstance(record, DataEnd):
                break
            if isinstance(record, Header):
                writer.start(record.profile, record.library)
                file.open()
            else:
                file.take(record)
        writer.add_metadata(PROVENANCE, dict(rewrite.provenance))
        _finish(writer)
    return file.counts


def qos_in_mcap(file: Path) -> dict[str, str]:
    """Return the QoS of each topic's publishers in the file's format.

    The result is empty if the file has no summary.

    Raises:
        McapError: if the file is damaged.
        OSError: if it cannot be read.
    """
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    channels = summary.channels.values() if summary else ()
    return {each.topic: each.metadata.get("offered_qos_profiles", "") for each in channels}


def _finish(writer: Any) -> None:
    """Finish the file and write its index.

    The library's method has no type annotations.
    """
    writer.finish()


def _writer_like(old: BinaryIO, new: BinaryIO) -> Writer:
    """Return a writer with the chunk size and the compression of a file."""
    for record in StreamReader(old, emit_chunks=True).records:
        if isinstance(record, Chunk):
            compression = _COMPRESSION.get(record.compression, CompressionType.NONE)
            return Writer(new, chunk_size=record.uncompressed_size, compression=compression)
        if isinstance(record, Message):
            return Writer(new, use_chunking=False)
        if isinstance(record, DataEnd):
            break
    return Writer(new)


class _McapRewrite:
    """Copies the records of a file to a writer, with corrections."""

    def __init__(self, rewrite: Rewrite, writer: Writer, summary: Summary | None) -> None:
        self._rewrite = rewrite
        self._writer = writer
        self._summary = summary
        self._schemas: dict[int, tuple[int, Schema | None]] = {0: (0, None)}
        self._channels: dict[int, tuple[int, str, Edit | None]] = {}
        #: Ids of channels that were registered for the opening messages, by topic.
        self._opened: dict[str, int] = {}
        self._is_open = False
        self.counts: Counter[str] = Counter()

    def open(self) -> None:
        """Write the opening messages, if the file has a summary with the start time."""
        statistics = self._summary and self._summary.statistics
        if statistics and statistics.message_count:
            self._open_at(statistics.message_start_time)

    def _open_at(self, stamp_ns: int) -> None:
        self._is_open = True
        for channel, data in self._rewrite.openings(stamp_ns):
            id_ = self._opened[channel.topic] = self._register(channel)
            self._write(channel.topic, id_, data, stamp_ns, stamp_ns, 0)

    def _register(self, channel: RecordedTopic) -> int:
        """Register a channel for opening messages; use the file's own channel if there is one."""
        for recorded in self._summary.channels.values() if self._summary else ():
            schema = self._summary.schemas.get(recorded.schema_id) if self._summary else None
            if recorded.topic == channel.topic and schema and schema.name == channel.type:
                id_ = self._writer.register_schema(schema.name, schema.encoding, schema.data)
                return int(
                    self._writer.register_channel(
                        recorded.topic, recorded.message_encoding, id_, recorded.metadata
                    )
                )
        id_ = self._writer.register_schema(
            channel.type, channel.encoding, channel.definition.encode()
        )
        metadata = {
            "offered_qos_profiles": self._rewrite.qos_of(channel.topic),
            "topic_type_hash": TF_HASH,
        }
        return int(self._writer.register_channel(channel.topic, "cdr", id_, metadata))

    def take(self, record: object) -> None:
        """Write a corrected record; skip records that the writer creates itself."""
        if isinstance(record, Message):
            self._take_message(record)
        elif isinstance(record, Schema):
            if record.id in self._schemas:  # repeated in each chunk
                return
            id_ = self._writer.register_schema(record.name, record.encoding, record.data)
            self._schemas[record.id] = id_, record
        elif isinstance(record, ChannelRecord):
            self._take_channel(record)
        elif isinstance(record, Attachment):
            self._writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )
        elif isinstance(record, Metadata):
            self._take_metadata(record)

    def _take_message(self, message: Message) -> None:
        if not self._is_open:  # a file without a summary
            self._open_at(message.log_time)
        id_, topic, edit = self._channels[message.channel_id]
        data = edit(message.data) if edit else message.data
        if data is not None:
            self._write(topic, id_, data, message.log_time, message.publish_time, message.sequence)

    def _take_channel(self, record: ChannelRecord) -> None:
        if record.id in self._channels:  # repeated in each chunk
            return
        schema_id, schema = self._schemas[record.schema_id]
        channel = RecordedTopic(record.topic, "")
        if schema is not None:
            text = schema.data.decode(errors="replace")
            channel = RecordedTopic(record.topic, schema.name, schema.encoding, text)
        id_ = self._opened.pop(record.topic, None)
        if id_ is None:
            id_ = self._writer.register_channel(
                record.topic, record.message_encoding, schema_id, record.metadata
            )
        self._channels[record.id] = id_, record.topic, self._rewrite.edit_of(channel)

    def _take_metadata(self, record: Metadata) -> None:
        entries = dict(record.metadata)
        if record.name == _ROSBAG2:
            entries.pop(_SERIALIZED, None)  # it describes the old bag
        if entries:
            self._writer.add_metadata(record.name, entries)

    def _write(  # noqa: PLR0913, PLR0917 (the fields of a message)
        self, topic: str, id_: int, data: bytes, log_ns: int, publish_ns: int, sequence: int
    ) -> None:
        self._writer.add_message(id_, log_ns, data, publish_ns, sequence)
        self.counts[topic] += 1
