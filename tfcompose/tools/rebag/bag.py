"""Reading and writing of bags: a folder with metadata.yaml, or a single .mcap or .db3 file.

A new bag has a temporary name in its final folder while it is written. It gets its final name when
it is complete.
"""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
import tempfile
from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import yaml
from mcap.exceptions import EndOfFile, McapError
from rosbags.rosbag2 import Reader

from tfcompose.foundation.reading import exists, is_file, is_folder, read_bytes
from tfcompose.tf.bags import ENDINGS, BagError, damage_error
from tfcompose.tf.ros.tf_codec import TF_MESSAGE
from tfcompose.tools.rebag.mcap_file import lacks_channels, messages_in, qos_in_mcap, rewrite_mcap
from tfcompose.tools.rebag.recorded_topic import QOS_BY_WORDS, TF_HASH, RecordedTopic
from tfcompose.tools.rebag.rewriting import InterruptedRewrite
from tfcompose.tools.rebag.sqlite_file import qos_in_sqlite, rewrite_sqlite

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from tfcompose.tools.rebag.rewriting import Rewrite

T = TypeVar("T")

METADATA = "metadata.yaml"
_INFORMATION = "rosbag2_bagfile_information"
_ZSTD = ".zstd"
#: The type of a topic without a schema in the summary of an MCAP file, as rosbags names it.
_NO_SCHEMA = "__schemaless__"
#: SQLite's messages when it cannot write the new file, with the system's error numbers.
_ERRNO = {"database or disk is full": errno.ENOSPC, "disk I/O error": errno.EIO}


@dataclass(frozen=True, slots=True)
class Bag:
    """A bag on disk."""

    path: Path
    #: The bag's files in order, relative to its folder.
    files: tuple[str, ...]
    #: The contents of metadata.yaml below ``rosbag2_bagfile_information``; None for a single file.
    information: dict[str, Any] | None = field(default=None)

    @property
    def folder(self) -> Path:
        """The folder with the bag's files."""
        return self.path if self.information is not None else self.path.parent

    @property
    def version(self) -> int:
        """The version of metadata.yaml."""
        return int((self.information or {}).get("version", QOS_BY_WORDS))

    @property
    def compresses_messages(self) -> bool:
        """Whether each message is compressed separately."""
        mode = str((self.information or {}).get("compression_mode", ""))
        return mode.lower() == "message"


def bag_at(path: Path) -> Bag:
    """Return the bag in a folder or in a single file.

    Raises:
        BagError: if there is no bag, or tfcompose cannot write this kind of bag.
    """
    if path.name == METADATA:
        path = path.parent
    if not exists(path):
        raise BagError(f"{path} does not exist")
    if not is_folder(path):
        if path.suffix not in ENDINGS:
            raise BagError(f"{path} is not a recording: those end in .mcap or .db3")
        return Bag(path, (path.name,))
    if not is_file(path / METADATA):
        raise BagError(
            f"{path} has no {METADATA}", "ros2 bag reindex writes it; or name a single file"
        )
    information = _information_in(path / METADATA)
    files = tuple(_file_names(information, path))
    compression = str(information.get("compression_format") or "zstd")
    if compression != "zstd":
        raise BagError(f"{path} is compressed with {compression}: only zstd can be read")
    return Bag(path, files, information)


def _information_in(file: Path) -> dict[str, Any]:
    try:
        document = yaml.safe_load(read_bytes(file))
        information = document[_INFORMATION]
    except (yaml.YAMLError, KeyError, TypeError, RecursionError, ValueError):
        information = None
    if not isinstance(information, dict):
        raise BagError(f"{file} is not the metadata of a bag", "ros2 bag reindex rewrites it")
    return information


def _file_names(information: dict[str, Any], path: Path) -> Iterator[str]:
    """Yield the names of the bag's files.

    Raises:
        BagError: if a file is missing or outside the bag's folder, or is not a .mcap or .db3 file.
    """
    names = information.get("relative_file_paths")
    if not isinstance(names, list) or not names:
        raise BagError(f"{path} names no file", "ros2 bag reindex rewrites metadata.yaml")
    for name in map(str, names):
        if Path(name).name != name or Path(name.removesuffix(_ZSTD)).suffix not in ENDINGS:
            raise BagError(f"{path}: {name} is no .mcap or .db3 file in that folder")
        if not is_file(path / name):
            raise BagError(f"{path}: {name} is missing")
        yield name


def note_static(bag: Bag, rewrite: Rewrite) -> None:
    """Pass every recorded fixed edge to the corrections, and the QoS and types of topics.

    Raises:
        BagError: if the bag cannot be read.
    """
    rewrite.metadata_version = bag.version
    if bag.compresses_messages:
        import zstandard  # noqa: PLC0415 (only such bags need it)

        rewrite.expand = _expand
        rewrite.compress = zstandard.ZstdCompressor().compress
    rewrite.types = _types(bag)
    notes: dict[str, Callable[[bytes], None]] = {}
    for (moving, fixed), correction in rewrite.corrections.items():
        notes[fixed] = correction.note_static
        if correction.nominal:
            notes[moving] = correction.note_moving
    for channel, data in _tf_messages(bag, rewrite, notes):
        with suppress(ValueError):  # the copy counts such messages
            notes[channel.topic](data)


def _expand(data: bytes) -> bytes:
    """Return a message that was compressed separately.

    Raises:
        ValueError: if it is not compressed, or damaged.
    """
    import zstandard  # noqa: PLC0415 (only such bags need it)

    try:
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error


def _types(bag: Bag) -> dict[str, set[str]]:
    """Return the types of each topic; an empty one if the summary of an MCAP file lacks it.

    Raises:
        BagError: if the bag cannot be read.
    """
    types: dict[str, set[str]] = {}
    with _reader(bag) as reader:
        for connection in reader.connections:
            type_ = "" if connection.msgtype == _NO_SCHEMA else connection.msgtype
            types.setdefault(connection.topic, set()).add(type_)
    return types


@contextmanager
def _reader(bag: Bag) -> Iterator[Reader]:
    """Open the bag; raise a BagError with a single sentence if it is damaged."""
    with _damage_of(bag.path), Reader(bag.path) as reader:
        yield reader


@contextmanager
def _damage_of(path: Path) -> Iterator[None]:
    try:
        yield
    except InterruptedRewrite:
        raise
    except Exception as error:  # noqa: BLE001 (a damaged bag makes libraries and databases raise anything)
        raise damage_error(str(path), error) from None


def check_bag(bag: Bag, rewrite: Rewrite) -> None:
    """Pass the bag's TF to the corrections without writing a file.

    Raises:
        BagError: if the bag cannot be read.
    """
    topics = [topic for pair in rewrite.corrections for topic in pair]
    for channel, data in _tf_messages(bag, rewrite, topics):
        edit = rewrite.tf_edit_of(channel)
        if edit:
            edit(data)


def _tf_messages(
    bag: Bag, rewrite: Rewrite, topics: Collection[str]
) -> Iterator[tuple[RecordedTopic, bytes]]:
    """Yield the TFMessages of these topics in the order of their times, or of their file."""
    files = [bag.folder / name for name in bag.files if name.endswith(".mcap")]
    if any(_read(file, lacks_channels) for file in files):
        for file in files:
            with _damage_of(file):
                for topic, type_, data in messages_in(file, topics):
                    rewrite.go_on()
                    if type_ == TF_MESSAGE:
                        yield RecordedTopic(topic, type_), data
        return
    with _reader(bag) as reader:
        connections = [
            connection
            for connection in reader.connections
            if connection.topic in topics and connection.msgtype in {TF_MESSAGE, _NO_SCHEMA}
        ]
        for connection, _, data in reader.messages(connections=connections) if connections else ():
            rewrite.go_on()
            yield RecordedTopic(connection.topic, TF_MESSAGE), bytes(data)


def write_corrected(bag: Bag, target: Path, rewrite: Rewrite) -> Counter[str]:
    """Write the corrected bag, and return its number of messages by topic.

    Raises:
        BagError: if a file of the bag is damaged. OSError: if the new bag cannot be written.
        InterruptedRewrite: if a signal came. As after an error, nothing is left of the new bag.
    """
    counts: Counter[str] = Counter()
    with _new_at(target, is_folder=bag.information is not None) as new:
        rewrite.qos = _qos(bag)
        if bag.information is None:
            return _rewrite_file(bag.path, new, rewrite)
        per_file = []
        for name in bag.files:
            per_file.append(_rewrite_file(bag.folder / name, new / name, rewrite))
            counts += per_file[-1]
        _write_metadata(bag, new / METADATA, per_file, rewrite)
    return counts


def _qos(bag: Bag) -> dict[str, str]:
    """Return the QoS of each topic's publishers, from the files of the bag."""
    qos: dict[str, str] = {}
    for name in bag.files:
        file = bag.folder / name
        if file.suffix != _ZSTD:
            qos |= _read(file, qos_in_mcap if file.suffix == ".mcap" else qos_in_sqlite) | qos
    return qos


def _read(source: Path, read: Callable[[Path], T]) -> T:
    """Return the result of ``read`` for a file of the bag.

    Raises:
        BagError: if it is damaged.
    """
    try:
        return read(source)
    except (McapError, EndOfFile, sqlite3.Error, KeyError, ValueError) as error:
        raise damage_error(str(source), error) from None


@contextmanager
def _new_at(target: Path, *, is_folder: bool) -> Iterator[Path]:
    """Yield a temporary path next to the target; rename it to the target on success."""
    staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    new = staging / target.name
    try:
        if is_folder:
            new.mkdir()
        yield new
        new.rename(target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _rewrite_file(source: Path, target: Path, rewrite: Rewrite) -> Counter[str]:
    if source.suffix == _ZSTD:
        return _rewrite_compressed(source, target, rewrite)
    write: Callable[[Path, Path, Rewrite], Counter[str]] = (
        rewrite_mcap if source.suffix == ".mcap" else rewrite_sqlite
    )
    try:
        return _read(source, lambda file: write(file, target, rewrite))
    except BagError as error:
        number = _ERRNO.get(str(error.__context__))
        if number:
            raise OSError(number, os.strerror(number), str(target)) from None
        raise


def _rewrite_compressed(source: Path, target: Path, rewrite: Rewrite) -> Counter[str]:
    """Rewrite a file that is compressed as a whole."""
    import zstandard  # noqa: PLC0415 (only such bags need it)

    plain = source.with_suffix("").name
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        old, new = Path(folder) / plain, Path(folder) / f"new-{plain}"
        with source.open("rb") as packed, old.open("wb") as unpacked:
            zstandard.ZstdDecompressor().copy_stream(packed, unpacked)
        counts = _rewrite_file(old, new, rewrite)
        old.unlink()
        with new.open("rb") as unpacked, target.open("wb") as packed:
            zstandard.ZstdCompressor().copy_stream(unpacked, packed, size=new.stat().st_size)
    return counts


def _write_metadata(bag: Bag, file: Path, per_file: list[Counter[str]], rewrite: Rewrite) -> None:
    """Write metadata.yaml with the new numbers of messages and the origin of the bag."""
    information = dict(bag.information or {})
    counts = sum(per_file, Counter())
    information["message_count"] = counts.total()
    information["topics_with_message_count"] = _topics(information, counts, rewrite)
    files = information.get("files")
    if isinstance(files, list) and len(files) == len(per_file):
        information["files"] = [
            {**entry, "message_count": each.total()}
            for entry, each in zip(files, per_file, strict=True)
        ]
    custom = information.get("custom_data")
    information["custom_data"] = {
        **(custom if isinstance(custom, dict) else {}),
        **rewrite.provenance,
    }
    text = yaml.safe_dump({_INFORMATION: information}, sort_keys=False, allow_unicode=True)
    file.write_text(text, "utf-8")


def _topics(
    information: dict[str, Any], counts: Mapping[str, int], rewrite: Rewrite
) -> list[dict[str, Any]]:
    topics = []
    left = dict(counts)
    for entry in information.get("topics_with_message_count") or ():
        name = entry["topic_metadata"]["name"]
        topics.append({**entry, "message_count": left.pop(name, 0)})
    for name, count in left.items():
        profiles: Any = rewrite.qos_of(name)
        if rewrite.metadata_version >= QOS_BY_WORDS:
            profiles = yaml.safe_load(profiles)
        metadata = {
            "name": name,
            "type": TF_MESSAGE,
            "serialization_format": "cdr",
            "offered_qos_profiles": profiles,
            "type_description_hash": TF_HASH,
        }
        topics.append({"topic_metadata": metadata, "message_count": count})
    return topics
