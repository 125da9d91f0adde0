"""Rewriting of a rosbag2 SQLite file: it copies the file and writes only changed rows."""

from __future__ import annotations

import sqlite3
from collections import Counter
from contextlib import closing
from typing import TYPE_CHECKING

from tfcompose.foundation.reading import exists
from tfcompose.tools.rebag.recorded_topic import TF_HASH, RecordedTopic

if TYPE_CHECKING:
    from pathlib import Path

    from tfcompose.tools.rebag.rewriting import Edit, Rewrite

#: The number of rows that are read at once.
_ROWS = 256


def rewrite_sqlite(source: Path, target: Path, rewrite: Rewrite) -> Counter[str]:
    """Write the corrected copy of a database, and return the number of messages by topic.

    SQLite copies unchanged rows as pages.

    Raises:
        sqlite3.Error: if the source is damaged, or the target cannot be written.
        OSError: if the source cannot be read.
    """
    with (
        closing(_open(source)) as old,
        closing(sqlite3.connect(target, isolation_level=None)) as new,
    ):
        old.backup(new)
        new.execute("PRAGMA journal_mode = OFF")  # a partial file is deleted anyway
        new.execute("PRAGMA synchronous = OFF")
        new.execute("BEGIN")
        _edit_messages(new, rewrite)
        if _has_table(new, "metadata"):  # it describes the old bag
            new.execute("DELETE FROM metadata")
        new.execute("COMMIT")
        return Counter(
            dict(
                new.execute(
                    "SELECT name, COUNT(messages.id) FROM topics"
                    " JOIN messages ON topics.id = messages.topic_id GROUP BY name"
                )
            )
        )


def qos_in_sqlite(file: Path) -> dict[str, str]:
    """Return the QoS of each topic's publishers in the file's format.

    Raises:
        sqlite3.Error: if the file is damaged.
    """
    with closing(_open(file)) as database:
        columns = [row[1] for row in database.execute("PRAGMA table_info(topics)")]
        if "offered_qos_profiles" not in columns:
            return {}
        return dict(database.execute("SELECT name, offered_qos_profiles FROM topics"))


def _open(file: Path) -> sqlite3.Connection:
    """Open a database for reading, without making a file beside it."""
    log = file.with_name(f"{file.name}-wal")
    is_complete = not (exists(log) and log.stat().st_size)  # else SQLite needs its shared memory
    options = "mode=ro&immutable=1" if is_complete else "mode=ro"
    return sqlite3.connect(f"{file.resolve().as_uri()}?{options}", uri=True)


def _edit_messages(database: sqlite3.Connection, rewrite: Rewrite) -> None:
    edits = _edits(database, rewrite)
    first = database.execute("SELECT MIN(timestamp), MIN(id) FROM messages").fetchone()
    openings = rewrite.openings(first[0]) if first[0] is not None else []
    if edits:
        _edit_rows(database, edits, rewrite)
    for number, (channel, data) in enumerate(reversed(openings), 1):
        topic_id = _topic_id(database, channel, rewrite)
        database.execute(
            "INSERT INTO messages (id, topic_id, timestamp, data) VALUES (?, ?, ?, ?)",
            (first[1] - number, topic_id, first[0], data),
        )


def _edits(database: sqlite3.Connection, rewrite: Rewrite) -> dict[int, Edit]:
    """Return the functions that change messages, by the id of their topic."""
    definitions: dict[str, tuple[str, str]] = {}
    if _has_table(database, "message_definitions"):
        rows = database.execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        definitions = {type_: (encoding, text) for type_, encoding, text in rows}
    edits = {}
    for id_, name, type_ in database.execute("SELECT id, name, type FROM topics").fetchall():
        edit = rewrite.edit_of(RecordedTopic(name, type_, *definitions.get(type_, ("", ""))))
        if edit is not None:
            edits[id_] = edit
    return edits


def _edit_rows(database: sqlite3.Connection, edits: dict[int, Edit], rewrite: Rewrite) -> None:
    """Change or delete rows in the order of their times."""
    marks = ", ".join("?" * len(edits))
    query = (
        "SELECT id, topic_id, timestamp, data FROM messages"  # noqa: S608 (marks are ?)
        f" WHERE topic_id IN ({marks}) AND (timestamp, id) > (?, ?)"
        f" ORDER BY timestamp, id LIMIT {_ROWS}"
    )
    last = (-(2**63), -(2**63))
    while rows := database.execute(query, (*edits, *last)).fetchall():
        rewrite.go_on()
        last = rows[-1][2], rows[-1][0]
        for id_, topic_id, _, data in rows:
            new = edits[topic_id](data)
            if new is None:
                database.execute("DELETE FROM messages WHERE id = ?", (id_,))
            elif new is not data:
                database.execute("UPDATE messages SET data = ? WHERE id = ?", (new, id_))


def _topic_id(database: sqlite3.Connection, channel: RecordedTopic, rewrite: Rewrite) -> int:
    """Return the id of a topic; add the topic if the file does not have it."""
    row = database.execute(
        "SELECT id FROM topics WHERE name = ? AND type = ?", (channel.topic, channel.type)
    ).fetchone()
    if row:
        return int(row[0])
    values = {
        "name": channel.topic,
        "type": channel.type,
        "serialization_format": "cdr",
        "offered_qos_profiles": rewrite.qos_of(channel.topic),
        "type_description_hash": TF_HASH,
    }
    columns = [row[1] for row in database.execute("PRAGMA table_info(topics)")]
    values = {name: value for name, value in values.items() if name in columns}
    cursor = database.execute(
        f"INSERT INTO topics ({', '.join(values)}) VALUES ({', '.join('?' * len(values))})",  # noqa: S608 (names are from above)
        tuple(values.values()),
    )
    _add_definition(database, channel)
    return int(cursor.lastrowid or 0)


def _add_definition(database: sqlite3.Connection, channel: RecordedTopic) -> None:
    if not _has_table(database, "message_definitions"):
        return
    row = database.execute(
        "SELECT 1 FROM message_definitions WHERE topic_type = ?", (channel.type,)
    ).fetchone()
    if not row:
        database.execute(
            "INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition,"
            " type_description_hash) VALUES (?, ?, ?, ?)",
            (channel.type, channel.encoding, channel.definition, TF_HASH),
        )


def _has_table(database: sqlite3.Connection, name: str) -> bool:
    return bool(
        database.execute(
            "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?", (name,)
        ).fetchone()
    )
