"""Rewriting of an MCAP file, chunk by chunk.

A chunk in which no message changes is written as it is, without compressing it again.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from io import BytesIO
from typing import TYPE_CHECKING

import lz4.frame  # mcap requires it
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment, Channel, Chunk, Message, Metadata, Schema, Statistics
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.summary import Summary

from tfcompose.tools.rebag.mcap_writer import HEAD, MAGIC, McapWriter, bytes_of
from tfcompose.tools.rebag.recorded_topic import TF_HASH, RecordedTopic

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from pathlib import Path
    from typing import BinaryIO

    from tfcompose.tools.rebag.mcap_writer import MessageIndexes
    from tfcompose.tools.rebag.rewriting import Edit, Rewrite

#: The metadata record in which rosbag2 keeps a copy of metadata.yaml, and the key in it.
_ROSBAG2, _SERIALIZED = "rosbag2", "serialized_metadata"
#: The name of tfcompose's metadata record.
PROVENANCE = "tfcompose"
#: The fields of a message before its data: channel, sequence, log time and publish time.
_MESSAGE = struct.Struct("<HIQQ")
#: The place of a message's data in its record.
_DATA = HEAD.size + _MESSAGE.size
#: Records that the writer makes itself.
_NOT_COPIED = frozenset({Opcode.MESSAGE_INDEX, Opcode.DATA_END})
_COMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "zstd": zstandard.compress,
    "lz4": lz4.frame.compress,
    "": bytes,
}


def rewrite_mcap(source: Path, target: Path, rewrite: Rewrite) -> Counter[str]:
    """Write the corrected copy of an MCAP file, and return the number of messages by topic.

    The copy has the source's chunks, compressed in the same way. Messages keep their order, times
    and sequence numbers.

    Raises:
        McapError: if the source is damaged.
        OSError: if a file cannot be read or written.
    """
    with source.open("rb") as old, target.open("wb") as new:
        summary = _complete_summary(old)
        old.seek(len(MAGIC))
        file = _McapRewrite(rewrite, McapWriter(new), summary)
        try:
            file.copy(old)
        except struct.error:
            raise EndOfFile from None
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


def lacks_channels(file: Path) -> bool:
    """Return whether the summary of a file does not have all channels; rosbags then finds none.

    Raises:
        McapError: if the file is damaged.
        OSError: if it cannot be read.
    """
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    statistics = summary and summary.statistics
    return bool(summary and statistics and len(summary.channels) != statistics.channel_count)


def messages_in(file: Path, topics: Collection[str]) -> Iterator[tuple[str, str, bytes]]:
    """Yield the topic, the type and the bytes of the messages of these topics, in file order.

    Raises:
        McapError: if the file is damaged.
        OSError: if it cannot be read.
    """
    with file.open("rb") as stream:
        messages = NonSeekingReader(stream).iter_messages(topics, log_time_order=False)
        for schema, channel, message in messages:
            yield channel.topic, schema.name if schema else "", message.data


def _complete_summary(stream: BinaryIO) -> Summary:
    """Return the summary of a file; read the whole file if its summary lacks some."""
    summary = make_reader(stream).get_summary()
    statistics = summary and summary.statistics
    if (
        summary
        and statistics
        and len(summary.channels) == statistics.channel_count
        and len(summary.schemas) == statistics.schema_count
    ):
        return summary
    summary, counts, times_ns = Summary(), Counter[int](), [2**64]
    stream.seek(0)
    for record in StreamReader(stream).records:
        if isinstance(record, Schema):
            summary.schemas[record.id] = record
        elif isinstance(record, Channel):
            summary.channels[record.id] = record
        elif isinstance(record, Message):
            counts[record.channel_id] += 1
            times_ns = [min(*times_ns, record.log_time)]
    summary.statistics = Statistics(
        attachment_count=0,
        channel_count=len(summary.channels),
        channel_message_counts=counts,
        chunk_count=0,
        message_count=counts.total(),
        message_start_time=times_ns[0],
        message_end_time=times_ns[0],
        metadata_count=0,
        schema_count=len(summary.schemas),
    )
    return summary


def _records_in(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield the opcode of each record with its start and its end.

    Raises:
        EndOfFile: if the last record is not complete.
    """
    start = 0
    while start < len(data):
        opcode, size = HEAD.unpack_from(data, start)
        end = start + HEAD.size + size
        if end > len(data):
            raise EndOfFile
        yield opcode, start, end
        start = end


def _recorded_topic(channel: Channel, schema: Schema | None) -> RecordedTopic:
    if schema is None:
        return RecordedTopic(channel.topic, "")
    text = schema.data.decode(errors="replace")
    return RecordedTopic(channel.topic, schema.name, schema.encoding, text)


class _McapRewrite:
    """Copies the records of a file to a writer, with corrections."""

    def __init__(self, rewrite: Rewrite, writer: McapWriter, summary: Summary) -> None:
        self._rewrite = rewrite
        self._writer = writer
        self._summary = summary
        self._edits: dict[int, Edit] = {}
        for id_, channel in summary.channels.items():
            edit = rewrite.edit_of(
                _recorded_topic(channel, summary.schemas.get(channel.schema_id))
            )
            if edit:
                self._edits[id_] = edit

    @property
    def counts(self) -> Counter[str]:
        """The number of written messages by topic."""
        counts: Counter[str] = Counter()
        for id_, count in self._writer.counts.items():
            counts[self._summary.channels[id_].topic] += count
        return counts

    def copy(self, old: BinaryIO) -> None:
        """Write the corrected file.

        Raises:
            EndOfFile: if the old one ends too early. struct.error: if a record is too short.
        """
        opcode, is_open = None, False
        while opcode != Opcode.DATA_END:
            self._rewrite.go_on()
            head = old.read(HEAD.size)
            opcode, size = HEAD.unpack(head)
            end = old.tell() + size
            if opcode == Opcode.CHUNK:
                chunk = Chunk.read(ReadDataStream(old))
                if not is_open:
                    self._write_chunk(*self._openings(), chunk.compression)
                self._take_chunk(chunk)
                is_open = True
            elif opcode == Opcode.MESSAGE:
                if not is_open:
                    self._write_records(*self._openings())
                self._write_records(*self._corrected(head + old.read(size)))
                is_open = True
            elif opcode not in _NOT_COPIED:
                self._take(opcode, head + old.read(size))
            old.seek(end)
        self._writer.add_metadata(Metadata(PROVENANCE, dict(self._rewrite.provenance)))
        self._writer.finish(self._summary.schemas, self._summary.channels)

    def _take(self, opcode: int, data: bytes) -> None:
        """Write a record that is neither a chunk nor a message."""
        stream = ReadDataStream(BytesIO(data[HEAD.size :]))
        if opcode == Opcode.ATTACHMENT:
            self._writer.add_attachment(Attachment.read(stream))
        elif opcode == Opcode.METADATA:
            record = Metadata.read(stream)
            if record.name == _ROSBAG2:
                record.metadata.pop(_SERIALIZED, None)  # it describes the old bag
            if record.metadata:
                self._writer.add_metadata(record)
        else:
            self._writer.write(data)

    def _take_chunk(self, chunk: Chunk) -> None:
        stream, size = get_chunk_data_stream(chunk)
        before = stream.read(size)
        after, indexes = self._corrected(before)
        if after is before:
            self._writer.add_chunk(chunk, indexes)
        else:
            self._write_chunk(after, indexes, chunk.compression)

    def _write_records(self, data: bytes, indexes: MessageIndexes) -> None:
        """Write records outside of chunks."""
        self._writer.write(data)
        for id_, entries in indexes.items():
            self._writer.count(id_, entries[::2])

    def _write_chunk(self, data: bytes, indexes: MessageIndexes, compression: str) -> None:
        """Write records as a chunk, or outside of chunks if no message is among them."""
        if not indexes:
            self._write_records(data, indexes)
            return
        times_ns = [time_ns for entries in indexes.values() for time_ns in entries[::2]]
        chunk = Chunk(
            compression=compression,
            data=_COMPRESS[compression](data),
            message_start_time=min(times_ns),
            message_end_time=max(times_ns),
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        self._writer.add_chunk(chunk, indexes)

    def _corrected(self, data: bytes) -> tuple[bytes, MessageIndexes]:
        """Return corrected records, or the same object if none changes, and their index."""
        view = memoryview(data)
        parts: list[bytes | memoryview] = []
        indexes: MessageIndexes = {}
        #: End of the records that are in ``parts``, and how much shorter they were before.
        done, shift = 0, 0
        for opcode, start, end in _records_in(data):
            if opcode != Opcode.MESSAGE:
                continue
            id_, _, log_time_ns, _ = _MESSAGE.unpack_from(data, start + HEAD.size)
            edit = self._edits.get(id_)
            offset = start + shift
            if edit:
                before = data[start + _DATA : end]
                after = edit(before)
                if after is not before:
                    parts.append(view[done:start])
                    done = end
                    if after is None:
                        shift -= end - start
                        continue
                    parts += (
                        HEAD.pack(opcode, _MESSAGE.size + len(after)),
                        view[start + HEAD.size : start + _DATA],
                        after,
                    )
                    shift += len(after) - len(before)
            indexes.setdefault(id_, []).extend((log_time_ns, offset))
        return b"".join((*parts, view[done:])) if parts else data, indexes

    def _openings(self) -> tuple[bytes, MessageIndexes]:
        """Return the opening messages after the channels that they need, and their index."""
        statistics, data = self._summary.statistics, b""
        indexes: MessageIndexes = {}
        stamp_ns = statistics.message_start_time if statistics else 0
        for topic, message in self._rewrite.openings(stamp_ns):
            channel = self._channel_of(topic)
            data += bytes_of(self._summary.schemas[channel.schema_id]) + bytes_of(channel)
            indexes[channel.id] = [stamp_ns, len(data)]
            data += bytes_of(Message(channel.id, stamp_ns, message, stamp_ns, 0))
        return data, indexes

    def _channel_of(self, topic: RecordedTopic) -> Channel:
        """Return the channel of a topic; add one if the file has none."""
        schemas, channels = self._summary.schemas, self._summary.channels
        for channel in channels.values():
            schema = schemas.get(channel.schema_id)
            if channel.topic == topic.topic and schema and schema.name == topic.type:
                return channel
        text = topic.definition.encode()
        schema = Schema(max(schemas, default=0) + 1, text, topic.encoding, topic.type)
        metadata = {
            "offered_qos_profiles": self._rewrite.qos_of(topic.topic),
            "topic_type_hash": TF_HASH,
        }
        id_ = max(channels, default=0) + 1
        schemas[schema.id] = schema
        channels[id_] = Channel(id_, topic.topic, "cdr", metadata, schema.id)
        return channels[id_]
