"""Stamps that are of another clock than they should be, in words; and times as people say them."""

from __future__ import annotations

_SECOND_NS = 1_000_000_000
#: tf2's buffers keep 10 s: what is farther off than that cannot be looked up together with the rest.
WRONG_BY_NS = 10 * _SECOND_NS
#: Before 2001: no time of day.
_NO_DATE_NS = 10**9 * _SECOND_NS


def other_clock(stamp_ns: int, received_ns: int, sim_ns: int | None, *, simulated: bool) -> str:
    """Return how a stamp is of another clock than it should be, empty where it is of the right one.

    ``received_ns`` is the system's time when it came, 0 where that is not known; ``sim_ns`` the newest time on /clock,
    None where there is none. ``simulated`` says which of the two it should be.
    """
    if stamp_ns == 0:
        return "without a stamp"
    near_sim = sim_ns is not None and abs(stamp_ns - sim_ns) <= WRONG_BY_NS
    near_system = bool(received_ns) and abs(stamp_ns - received_ns) <= WRONG_BY_NS
    if simulated and sim_ns is not None:
        if near_sim:
            return ""
        if near_system:
            return f"with the system's time, and /clock says {sim_ns / 1e9:.1f} s"
        return f"with {stamp_ns / 1e9:.1f} s, {_off(stamp_ns, sim_ns)} /clock"
    if simulated or near_system or not received_ns:
        return ""
    if near_sim:
        return f"with simulated time ({stamp_ns / 1e9:.1f} s), and others with the system's"
    if stamp_ns < _NO_DATE_NS:
        return f"with {stamp_ns / 1e9:.1f} s, which is simulated time, or time since a start"
    return f"{_off(stamp_ns, received_ns)} the system's time"


def _off(stamp_ns: int, reference_ns: int) -> str:
    return f"{seconds((reference_ns - stamp_ns) / 1e9)} {'behind' if stamp_ns < reference_ns else 'ahead of'}"


def seconds(value: float) -> str:
    """Return a time, or how long that is, as people say it: 120 ms, 3.2 s, 2.5 h."""
    size = abs(value)
    if size < 1:
        return f"{size * 1000:.0f} ms"
    if size < 600:  # noqa: PLR2004 (ten minutes)
        return f"{size:.3g} s"
    return f"{size / 3600:.3g} h" if size < 48 * 3600 else f"{size / 86400:,.0f} days"
