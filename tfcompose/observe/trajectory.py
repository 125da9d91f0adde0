"""The poses of one frame in another at many times at once; needs numpy."""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tfcompose.observe.exceptions import ExtrapolationException, TransformException
from tfcompose.observe.rotation import IDENTITY, inverse, inverse_product, product

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tfcompose.observe.chain import Chain
    from tfcompose.observe.core import BufferCore
    from tfcompose.observe.history import History

    Floats = NDArray[np.float64]
    Stamps = NDArray[np.int64]

# So many times are handled at once, with so many arrays of their length at most.
_BLOCK = 1 << 14
_ARRAYS = 64
# Angles, in radians, up to which sine and cosine are summed up, to x¹³ and x¹².
_SMALL = 0.4
_SINE = [(-1) ** k / factorial(2 * k + 1) for k in range(6, -1, -1)]
_COSINE = [(-1) ** k / factorial(2 * k) for k in range(6, -1, -1)]


class Trajectory(NamedTuple):
    """N poses of a frame in another: ``xyz`` N×3 in metres, ``quat_xyzw`` N×4, unit quaternions with w ≥ 0."""

    xyz: Floats
    quat_xyzw: Floats

    def matrices(self) -> Floats:
        """Return the poses as homogeneous matrices, N×4×4: they take coordinates in the source to the target."""
        x, y, z, w = self.quat_xyzw.T
        made = np.zeros((len(self.xyz), 4, 4))
        made[:, 0, 0], made[:, 0, 1], made[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
        made[:, 1, 0], made[:, 1, 1], made[:, 1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
        made[:, 2, 0], made[:, 2, 1], made[:, 2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
        made[:, :3, 3], made[:, 3, 3] = self.xyz, 1.0
        return made


def stamps_of(stamps: ArrayLike) -> Stamps:
    """Return times in nanoseconds as an array of int64.

    Raises:
        TypeError: if they are not whole numbers in one row.
    """
    given = np.asarray(stamps)
    if given.ndim != 1 or (given.dtype.kind not in "iu" and given.size):
        raise TypeError(f"stamps are one row of whole nanoseconds, not {given.dtype} of shape {given.shape}")
    return given.astype(np.int64)


def lookup_many(buffer: BufferCore, target: str, source: str, stamps: ArrayLike, outside: str) -> Trajectory:
    """Return what ``Buffer.lookup_many`` does."""
    times = stamps_of(stamps)
    with buffer.at_rest():
        if not times.all():
            times = np.where(times == 0, buffer.lookup(target, source)[1], times)
        chain = buffer.chain_for_all_times(target, source)
        found, known = _at_once(chain, times) if chain else _one_by_one(buffer, target, source, times)
        if outside == "raise" and not known.all():
            first = int(times[np.argmin(known)])
            reason = buffer.can_lookup(target, source, first)
            raise ExtrapolationException(f"{reason}; so it is for {np.count_nonzero(~known)} of {len(times)} times")
    found.xyz[~known], found.quat_xyzw[~known] = np.nan, np.nan
    return found


def _one_by_one(buffer: BufferCore, target: str, source: str, stamps: Stamps) -> tuple[Trajectory, NDArray[np.bool_]]:
    """Return the poses where frames change their parents, so that each time may have a chain of its own."""
    known = np.ones(len(stamps), bool)
    found = Trajectory(np.zeros((len(stamps), 3)), np.zeros((len(stamps), 4)))
    for index, stamp_ns in enumerate(stamps.tolist()):
        try:
            pose, _ = buffer.lookup(target, source, stamp_ns)
        except TransformException:
            known[index] = False
        else:
            found.xyz[index], found.quat_xyzw[index] = pose.xyz, pose.quat_xyzw
    return found, known


def _at_once(chain: Chain, stamps: Stamps) -> tuple[Trajectory, NDArray[np.bool_]]:
    """Return the poses at those times, and which times all edges know; the poses at others mean nothing."""
    known = np.ones(len(stamps), bool)
    found = Trajectory(np.empty((len(stamps), 3)), np.empty((len(stamps), 4)))
    order = None if (stamps[1:] >= stamps[:-1]).all() else np.argsort(stamps, kind="stable")
    for start in range(0, len(stamps), _BLOCK):
        block: Any = slice(start, start + _BLOCK) if order is None else order[start : start + _BLOCK]
        times = stamps[block]
        _keep_memory(len(times))
        some = np.ones(len(times), bool)
        pose = _along(chain, times, some)
        known[block] = some
        found.xyz[block], found.quat_xyzw[block] = _of_unit_length(pose, len(times))
    return found, known


def _keep_memory(count: int) -> None:
    """Free an array as large as all that one block needs, without ever touching it.

    After that the C library (glibc) keeps so much memory between the steps, which else goes back to the system and is
    fetched again page by page; that took longer than the arithmetic.
    """
    np.empty((_ARRAYS, count))


def _along(chain: Chain, stamps: Stamps, known: NDArray[np.bool_]) -> tuple[Any, ...]:
    """Return the chain's poses at ascending times, and unset ``known`` where an edge has none."""
    pose: Any = None
    for history, fixed, backwards in chain.links:
        link: Any = fixed if history is None else _poses(history, stamps, known)
        if pose is None:
            pose = inverse(link) if backwards else link
        else:
            pose = inverse_product(link, pose) if backwards else product(link, pose)
    return pose or IDENTITY


def _of_unit_length(pose: tuple[Any, ...], count: int) -> Trajectory:
    xyz, quat = np.empty((count, 3)), np.empty((count, 4))
    qx, qy, qz, qw = pose[3:]
    scale = np.copysign(1 / np.sqrt(qx * qx + qy * qy + qz * qz + qw * qw), qw)
    for column, part in zip(xyz.T, pose[:3], strict=True):
        column[:] = part
    for column, part in zip(quat.T, pose[3:], strict=True):
        np.multiply(part, scale, out=column)
    return Trajectory(xyz, quat)


def _poses(history: History, stamps: Stamps, known: NDArray[np.bool_]) -> tuple[Floats, ...]:
    """Return the edge's poses at those ascending times, seven arrays, and unset ``known`` where there is none."""
    count = len(history)
    at = np.array(history.stamps)[-count:]
    samples = np.array(history.poses)[-7 * count :].reshape(count, 7).T.copy()
    known[: np.searchsorted(stamps, at[0])] = False
    known[np.searchsorted(stamps, at[-1], "right") :] = False
    if count == 1:
        return tuple(samples)
    # Each stretch goes from one sample to the next. A time that is a sample's belongs to the stretch behind it, and
    # there to the last sample of that time; but the first time of all to the first sample, the last to the last.
    begins = np.searchsorted(stamps, at[1:-1])
    if at[0] == at[1]:
        begins[: np.searchsorted(at[1:-1], at[0], "right")] = np.searchsorted(stamps, at[0], "right")
    times = np.diff(begins, prepend=0, append=len(stamps))  # so many on each stretch
    since = (stamps - at[0]).astype(np.float64)
    rows = np.repeat(_stretches(at, samples), times, axis=1)
    x, y, z, dx, dy, dz, ax, ay, az, aw, bx, by, bz, bw, angle, start, per_ns = rows
    part = (since - start) * per_ns
    sine, cosine = _sine_cosine(part * angle)
    return (
        x + dx * part,
        y + dy * part,
        z + dz * part,
        ax * cosine + bx * sine,
        ay * cosine + by * sine,
        az * cosine + bz * sine,
        aw * cosine + bw * sine,
    )


def _stretches(at: Stamps, samples: Floats) -> Floats:
    """Return 17 rows with a column for each stretch.

    Position at its begin, and the way to its end; quaternion at its begin, and the one at right angles to it, in whose
    direction it turns the short way; by what angle; nanoseconds from the first sample; 1 over its length.
    """
    begin, end = samples[:, :-1], samples[:, 1:]
    dot = (begin[3:] * end[3:]).sum(axis=0)
    to = np.where(dot < 0, -end[3:], end[3:]) - begin[3:] * np.abs(dot)
    sine = np.sqrt((to * to).sum(axis=0))
    to /= np.where(sine == 0, 1.0, sine)
    steps = np.diff(at)
    per_ns = 1 / np.where(steps == 0, np.inf, steps)
    rest = np.stack([np.arctan2(sine, np.abs(dot)), (at[:-1] - at[0]).astype(np.float64), per_ns])
    rows = np.concatenate([begin[:3], end[:3] - begin[:3], begin[3:], to, rest])
    if steps[-1] == 0:  # of two newest samples the last counts
        rows[:3, -1], rows[6:10, -1] = samples[:3, -1], samples[3:, -1]
    return rows


def _sine_cosine(angles: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine; of small angles by their series, which numpy adds up in a third of the time.

    The first term that is left out is below the rounding of a double.
    """
    if len(angles) == 0 or max(angles.max(), -angles.min()) > _SMALL:
        return np.sin(angles), np.cos(angles)
    squared = angles * angles
    sine, cosine = _SINE[0], _COSINE[0]
    for p, q in zip(_SINE[1:], _COSINE[1:], strict=True):
        sine, cosine = sine * squared + p, cosine * squared + q
    return sine * angles, cosine
