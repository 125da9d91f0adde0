"""Files about a case for later inspection: a bag of its TF, and a picture of the tree."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.cli.tree_picture import graph_of_observers, picture
from tfcompose.cli.writing import replace_file
from tfcompose.tf.bag_writing import BagWriter
from tfcompose.tf.ros.tf_codec import TF_MESSAGE, SentTransform, encode

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from tfcompose.tf.live.edges import TreeObserver
    from tfcompose.tf.ros.tf_codec import Row
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.replay import MessageLog

    Topics = tuple[str, str]

_SECOND_NS = 1_000_000_000


def write_evidence(
    folder: Path,
    case: Case,
    trees: Mapping[Topics, TreeObserver],
    logs: Mapping[Topics, MessageLog],
) -> None:
    """Write the bag ``tf`` and the picture ``tree.svg`` of a case into a folder.

    Raises:
        OSError: if they cannot be written.
    """
    graph = graph_of_observers(list(trees.values()), case.spec.name, case.plan, poses=True)
    replace_file(folder / "tree.svg", picture(graph, ".svg"))
    write_bag(folder / "tf", logs)


def write_bag(folder: Path, logs: Mapping[Topics, MessageLog]) -> None:
    """Write a bag with the messages of each pair of topics (moving, fixed), in their order.

    Raises:
        OSError: if it cannot be written.
    """
    messages = [
        (arrival.received_ns, topics[arrival.static], arrival)
        for topics, log in logs.items()
        for arrival in (*log.fixed, *log.moving)
    ]
    with BagWriter(folder) as writer:
        for received_ns, topic, arrival in sorted(messages, key=lambda each: each[0]):
            data = _message(arrival.rows)
            writer.write(topic, TF_MESSAGE, data, received_ns, latched=arrival.static)


def _message(rows: Sequence[Row]) -> bytes:
    return encode(
        [
            SentTransform(row[2] * _SECOND_NS + row[3], row[0], row[1], row[4:7], row[7:11])
            for row in rows
        ]
    )
