"""Observation of the live tree, for guard, monitor, doctor, verify, tree, graph and echo.

``topics`` receives messages, and ``publishers`` tracks publishers. ``edges`` and ``arrivals``
track edges. ``ros_feed`` feeds observers, and ``snapshot`` fills a ``TreeState``.
"""
