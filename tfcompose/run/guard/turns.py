"""Who sent each frame last, and before: two that take turns are told from one that was started anew."""

from __future__ import annotations

from collections import OrderedDict

#: Of frames that nobody planned so many are remembered.
MOST = 10_000


class Turns:
    """The current publisher of each frame by id, and the one before."""

    def __init__(self) -> None:
        self._gids: OrderedDict[str, tuple[bytes, bytes | None]] = OrderedDict()

    def take(self, child: str, gid: bytes) -> tuple[bytes, bytes | None]:
        """Note that this publisher sent the frame now; return the current one until now, and the one before it."""
        current, before = self._gids.get(child, (gid, None))
        self._gids[child] = (gid, before if current == gid else current)
        if len(self._gids) > MOST:
            self._gids.popitem(last=False)
        return current, before

    def forget(self, child: str) -> None:
        """Take whoever sends the frame next as the first."""
        self._gids.pop(child, None)

    def known(self, child: str) -> bool:
        """Whether somebody has sent the frame."""
        return child in self._gids

    def memory(self) -> dict[str, list[str]]:
        """Return what the next guard must know, as values of JSON."""
        return {child: [gid.hex(), before.hex() if before else ""] for child, (gid, before) in self._gids.items()}

    def recall(self, memory: dict[str, list[str]]) -> None:
        """Know what the guard before knew."""
        for child, (gid, before) in memory.items():
            self._gids[child] = (bytes.fromhex(gid), bytes.fromhex(before) or None)

    def current(self, child: str) -> bytes | None:
        """Return who sent it last."""
        return self._gids[child][0] if child in self._gids else None
