"""Observes the live tree once, for the guard, monitor, doctor, verify, tree, graph and echo.

``topics`` receives messages, ``publishers`` keeps who published, ``edges`` and ``arrivals`` keep
what came of each edge; ``listener`` feeds observers, and ``snapshot`` fills a ``TreeState``.
"""
