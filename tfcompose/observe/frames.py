"""What a buffer holds, edge by edge, and as the texts that tf2's tools print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.observe.history import History

# tf2 divides by no less, so that a frame with one sample has a rate of 10,000.
_SHORTEST_S = 100e-6


@dataclass(frozen=True, slots=True)
class FrameInfo:
    """A frame's edge to its parent; ``parent`` is empty for a root, and for a moving frame after ``clear``.

    Times are in nanoseconds since the epoch, and 0 for a fixed edge, which is good at any time; ``samples`` counts what
    is kept.
    """

    name: str
    parent: str
    static: bool
    authority: str
    oldest_ns: int
    newest_ns: int
    samples: int


def frame_info(name: str, history: History | None) -> FrameInfo:
    """Return what is known of a frame."""
    if history is None or not len(history):
        return FrameInfo(name, "", static=False, authority="", oldest_ns=0, newest_ns=0, samples=0)
    oldest, newest = (0, 0) if history.static else (history.oldest_ns, history.newest_ns)
    return FrameInfo(name, history.parent, history.static, history.authority, oldest, newest, len(history))


def as_string(frames: Iterable[FrameInfo]) -> str:
    """Return a line for each frame that has a parent, in tf2's words."""
    return "".join(f"Frame {frame.name} exists with parent {frame.parent}.\n" for frame in frames if frame.parent)


def as_yaml(frames: Iterable[FrameInfo]) -> str:
    """Return the frames as the YAML that tf2's ``tf2_frames`` service gives view_frames."""
    return "".join(map(_yaml, (frame for frame in frames if frame.parent))) or "[]"


def as_dot(frames: Iterable[FrameInfo]) -> str:
    """Return the edges as a graph for graphviz, each with who sent it, its rate and its times."""
    edges = "".join(map(_dot, (frame for frame in frames if frame.parent)))
    return f"digraph G {{\n{edges}}}"


def _dot(frame: FrameInfo) -> str:
    length_s = (frame.newest_ns - frame.oldest_ns) / 1e9
    said = (
        f"Broadcaster: {frame.authority or 'default_authority'}\\n"
        f"Average rate: {_rate(frame, length_s):.3f} Hz\\n"
        f"Most recent transform: {frame.newest_ns / 1e9:.6f} \\n"
        f"Buffer length: {length_s:.3f} sec\\n"
    )
    ends = " -> ".join(f'"{name}"' for name in (frame.parent, frame.name))
    return f'{ends}[label="{said}"];\n'


def _rate(frame: FrameInfo, length_s: float) -> float:
    return frame.samples / max(length_s, _SHORTEST_S)


def _yaml(frame: FrameInfo) -> str:
    length_s = (frame.newest_ns - frame.oldest_ns) / 1e9
    return (
        f"{frame.name}: \n"
        f"  parent: '{frame.parent}'\n"
        f"  broadcaster: '{frame.authority or 'default_authority'}'\n"
        f"  rate: {_rate(frame, length_s):.3f}\n"
        f"  most_recent_transform: {frame.newest_ns / 1e9:.6f}\n"
        f"  oldest_transform: {frame.oldest_ns / 1e9:.6f}\n"
        f"  buffer_length: {length_s:.3f}\n"
    )
