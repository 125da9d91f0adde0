"""A guard whose rmw does not say who sent a message, as with Cyclone DDS."""

import os
import sys
from pathlib import Path

from tests.support.launcher import EXECUTES

#: Read by each Python that starts.
_SITE = """
import sys
if "guard" in sys.orig_argv:
    import dataclasses
    import tfcompose.tf.ros.graph as graph
    gid_of = graph.gid_of
    graph.gid_identifies_node = lambda node: False
    graph.gid_of = lambda publisher: gid_of(publisher)[::-1]
    import tfcompose.tf.ros.node as node
    receive = node.Subscription._receive
    def turned(self):
        received = receive(self)
        return dataclasses.replace(received, raw_gid=received.raw_gid[::-1])
    node.Subscription._receive = turned
"""


def guard_without_ids(folder: Path) -> dict[str, str]:
    """Return what makes guards nameless that are started with it in their environment."""
    site = folder / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(EXECUTES + _SITE, encoding="utf-8")
    return {"PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)])}
