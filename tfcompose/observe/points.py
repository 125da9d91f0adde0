"""Arrays of points moved to another frame; needs numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.geometry import matrix_from_quat
from tfcompose.observe.exceptions import InvalidArgumentException

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tfcompose.observe.rotation import Seven

# So many points at a time stay in the processor's cache.
_BLOCK = 1 << 13


def moved_points(points: ArrayLike, pose: Seven) -> NDArray[Any]:
    """Return points in the parent's frame, from points in the child's whose pose in the parent is given.

    ``points`` has the shape (…, 3), in metres; the result has it too. float32 and float64 stay what they are, other
    numbers become float64; what is computed is float64. NaN stays NaN.

    Raises:
        InvalidArgumentException: if the last dimension is not 3.
    """
    given = np.asarray(points)
    if given.ndim == 0 or given.shape[-1] != 3:  # noqa: PLR2004 (x, y, z)
        raise InvalidArgumentException(f"points have the shape (…, 3), not {given.shape}")
    moved = np.empty(given.shape, given.dtype if given.dtype in (np.float32, np.float64) else np.float64)
    turned, to = turn_and_shift(pose)
    rows, out = given.reshape(-1, 3), moved.reshape(-1, 3)
    for start in range(0, len(rows), _BLOCK):
        block = slice(start, start + _BLOCK)
        out[block] = rows[block].astype(np.float64, copy=False) @ turned + to
    return moved


def turn_and_shift(pose: Seven) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what takes rows of points along: ``rows @ turn + shift``; 3×3 and 3."""
    x, y, z, qx, qy, qz, qw = pose
    return np.array(matrix_from_quat((qx, qy, qz, qw))).T.copy(), np.array((x, y, z))
