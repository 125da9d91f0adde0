"""Observation of the live tree, shared by guard, monitor, doctor, verify, tree, graph and echo.

``topics`` receives messages, ``publishers`` tracks publishers, ``edges`` and ``arrivals`` track
edges; ``listener`` feeds observers, and ``snapshot`` fills a ``TreeState``.
"""
