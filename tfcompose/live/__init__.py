"""One observation of the live tree, for the guard, monitor, doctor, verify, tree, graph and echo.

``topics`` brings messages and says who publishes (``publishers`` remembers it), ``edges`` and ``arrivals`` say what was
seen of each edge, ``sensors`` what came besides TF. ``listener`` feeds observers, and ``snapshot`` puts all of it into
one ``state``. What that means is for ``tfcompose.verdict`` to say; nothing here knows a verdict.
"""
