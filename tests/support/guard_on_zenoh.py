"""A guard that reads TF from Zenoh where rclpy has no such middleware.

Its node stays on the middleware that is there, and finds nobody; messages come by eclipse-zenoh,
with the ids of their attachments, and who publishes is asked of liveliness tokens, as always on
Zenoh.
"""

import os
import sys
from pathlib import Path

from tests.support.launcher import EXECUTES

#: Read by each Python that starts.
_SITE = """
import sys
if "guard" in sys.orig_argv:
    import atexit
    import os
    import tfcompose.tf.ros.graph as graph
    import tfcompose.tf.ros.node as node
    from tfcompose.tf.ros.zenoh_graph import ZenohTF, domain_of, open_session
    graph.get_rmw_implementation_identifier = node.middleware = lambda: "rmw_zenoh_cpp"
    graph._ask = lambda node: False
    session, open_here = open_session(os.environ), []
    atexit.register(session.close)
    class ZenohSubscription(node.TFSubscription):
        def __init__(self, of, *, static, topic=None, deep=False):
            super().__init__(of, static=static, topic=topic, deep=deep)
            self._static = static
            self._zenoh = ZenohTF(session, domain_of(os.environ), (self.topic, self.topic))
            open_here.append(self._zenoh)
        def take(self):
            return [self._as_received(one) for one in self._zenoh.take() if one.static == self._static]
        def _as_received(self, one):
            gid, source_ns, sequence = None, 0, 0
            if one.attachment:
                gid, source_ns, sequence = one.attachment.gid, one.attachment.source_ns, one.attachment.sequence
            return node.Received(one.data, gid, source_ns, one.received_ns, sequence, gid)
    node.TFSubscription = ZenohSubscription
    import tfcompose.tf.live.topics as topics
    def close(self):
        for one in open_here:
            one.close()
    topics.TFTopics.close = close
"""  # noqa: E501 (a text as its reader has it)


def guard_on_zenoh(folder: Path, router: str) -> dict[str, str]:
    """Return what makes guards read Zenoh that are started with it in their environment."""
    site = folder / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(EXECUTES + _SITE, encoding="utf-8")
    override = f'mode="peer";connect/endpoints=["{router}"]'
    return {
        "PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)]),
        "ZENOH_CONFIG_OVERRIDE": override,
    }
