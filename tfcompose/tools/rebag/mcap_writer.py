"""Writer of MCAP files that takes whole chunks, and indexes them (https://mcap.dev/spec).

The writer of the library ``mcap`` takes single messages; it assigns ids and fills chunks itself.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from typing import TYPE_CHECKING, Any

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    ChunkIndex,
    DataEnd,
    Footer,
    Metadata,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import BinaryIO

    from mcap.records import Channel, Chunk, McapRecord, Schema

#: By channel, the log time of each message in nanoseconds, followed by its offset in the chunk.
MessageIndexes = dict[int, list[int]]

MAGIC = b"\x89MCAP0\r\n"
#: The opcode and the length of a record.
HEAD = struct.Struct("<BQ")
#: Times, size and CRC of a chunk, and the length of its compression's name.
_CHUNK = struct.Struct("<QQQII")
_SIZE = struct.Struct("<Q")
_CRC = struct.Struct("<I")


def bytes_of(record: McapRecord) -> bytes:
    """Return a record as in a file."""
    builder: Any = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


class McapWriter:
    """Writes the records of a file, and at the end its summary."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        #: The log times of the first and the last message in nanoseconds; empty without a message.
        self._range_ns: tuple[int, ...] = ()
        #: The number of messages of each channel.
        self.counts: Counter[int] = Counter()
        stream.write(MAGIC)

    def write(self, data: bytes | memoryview) -> None:
        """Write records that no index lists."""
        self._stream.write(data)

    def count(self, channel_id: int, log_times_ns: list[int]) -> None:
        """Add messages of a channel to the statistics."""
        self.counts[channel_id] += len(log_times_ns)
        times_ns = (*self._range_ns, *log_times_ns)
        self._range_ns = min(times_ns), max(times_ns)

    def add_chunk(self, chunk: Chunk, indexes: MessageIndexes) -> None:
        """Write a chunk, whose data can be compressed, and the index of its messages."""
        start, size = self._stream.tell(), len(chunk.data)
        name = chunk.compression.encode()
        times_ns = chunk.message_start_time, chunk.message_end_time
        self.write(HEAD.pack(Opcode.CHUNK, _CHUNK.size + len(name) + _SIZE.size + size))
        self.write(
            _CHUNK.pack(*times_ns, chunk.uncompressed_size, chunk.uncompressed_crc, len(name))
        )
        self.write(name + _SIZE.pack(size))
        self.write(chunk.data)
        end, offsets = self._stream.tell(), {}
        for id_, entries in indexes.items():
            offsets[id_] = self._stream.tell()
            data = struct.pack(f"<HI{len(entries)}Q", id_, 8 * len(entries), *entries)
            self.write(HEAD.pack(Opcode.MESSAGE_INDEX, len(data)) + data)
            self.count(id_, entries[::2])
        self._chunks.append(
            ChunkIndex(
                message_start_time=times_ns[0],
                message_end_time=times_ns[1],
                chunk_start_offset=start,
                chunk_length=end - start,
                message_index_offsets=offsets,
                message_index_length=self._stream.tell() - end,
                compression=chunk.compression,
                compressed_size=size,
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def add_attachment(self, record: Attachment) -> None:
        """Write an attachment."""
        offset, data = self._stream.tell(), bytes_of(record)
        self._attachments.append(
            AttachmentIndex(
                offset=offset,
                length=len(data),
                log_time=record.log_time,
                create_time=record.create_time,
                data_size=len(record.data),
                name=record.name,
                media_type=record.media_type,
            )
        )
        self.write(data)

    def add_metadata(self, record: Metadata) -> None:
        """Write metadata."""
        offset, data = self._stream.tell(), bytes_of(record)
        self._metadata.append(MetadataIndex(offset=offset, length=len(data), name=record.name))
        self.write(data)

    def finish(self, schemas: Mapping[int, Schema], channels: Mapping[int, Channel]) -> None:
        """Write the summary and the end of the file."""
        self.write(bytes_of(DataEnd(0)))
        first_ns, last_ns = self._range_ns or (0, 0)
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(channels),
            channel_message_counts=dict(self.counts),
            chunk_count=len(self._chunks),
            message_count=self.counts.total(),
            message_start_time=first_ns,
            message_end_time=last_ns,
            metadata_count=len(self._metadata),
            schema_count=len(schemas),
        )
        groups: tuple[list[Any], ...] = (
            list(schemas.values()),
            list(channels.values()),
            [statistics],
            self._chunks,
            self._attachments,
            self._metadata,
        )
        start, summary, offsets = self._stream.tell(), b"", b""
        for group in groups:
            data = b"".join(map(bytes_of, group))
            if data:
                offset = start + len(summary)
                offsets += bytes_of(SummaryOffset(data[0], offset, len(data)))
            summary += data
        footer = bytes_of(Footer(start, start + len(summary), 0))[: -_CRC.size]
        data = summary + offsets + footer
        self.write(data + _CRC.pack(zlib.crc32(data)) + MAGIC)
