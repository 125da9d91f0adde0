"""Which ports of Fast DDS's shared memory a process reads.

Who first writes to an idle one may wait for 333 ms.
"""

import os
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tfcompose.launcher.fastdds_profile import with_partitions
from tfcompose.model.plan import Discovery, RosSettings
from tfcompose.tf.ros.environment import (
    FASTDDS_PROFILE_LOCALHOST,
    PROFILE_VARIABLES,
    child_environment,
)

pytestmark = pytest.mark.ros

#: Says which ports the process holds as their reader: Fast DDS locks a file beside each.
NODE = """
import os
from pathlib import Path
from tfcompose.tf.ros.node import open_node
with open_node("one", "/"):
    held = {os.readlink(one) for one in Path("/proc/self/fd").iterdir() if one.exists()}
print(*sorted(one for one in held if "fastrtps_port" in one))
"""


@pytest.mark.parametrize("discovery", ["localhost", "subnet"])
@pytest.mark.parametrize("is_built_in", [True, False])
def test_tfcomposes_own_processes_read_no_shared_memory_and_others_do(
    domain: object, discovery: Discovery, *, is_built_in: bool
) -> None:
    assert domain
    env = child_environment(os.environ, RosSettings(discovery=discovery), is_built_in=is_built_in)
    output = processes.run([sys.executable, "-c", NODE], env=env, check=True)
    assert (output.stdout == "\n") == is_built_in, output.stdout


#: Says how many UDP ports the process takes messages at, before and after it reads outside of
#: partitions.
APART = """
import os
from pathlib import Path
from tfcompose.tf.ros.node import PublicTFReader, open_node
def ports():
    held = {os.readlink(one) for one in Path("/proc/self/fd").iterdir() if one.exists()}
    lines = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    return len({words[1] for words in lines if f"socket:[{words[9]}]" in held})
with open_node("one", "/") as node:
    before = ports()
    reader = PublicTFReader(node, "/tf", static=False)
    print(ports() - before)
    reader.close()
"""


def test_what_everybody_sends_has_a_port_of_its_own_at_a_strict_guard(domain: object) -> None:
    """What does not fit into a port's buffer is thrown away.

    A flood would take what is fenced off with it.
    """
    assert domain
    env = child_environment(os.environ, RosSettings(discovery="localhost"), is_built_in=True)
    assert processes.run([sys.executable, "-c", APART], env=env, check=True).stdout == "1\n"


#: Says whom a strict guard's reader hears: its own process, another one.
OWN_AND_ANOTHER = """
import time
from tfcompose.tf.ros.node import PublicTFReader, TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
data = encode([SentTransform(1, "odom", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])
with open_node("guard", "/") as node, open_node("another", "/") as other:
    reader = PublicTFReader(node, "/tf", static=False)
    own, another = (TFPublisher(each, static=False) for each in (node, other))
    heard, deadline, further = set(), time.monotonic() + 30, 5
    while further and time.monotonic() < deadline:
        for publisher in (own, another):
            publisher.publish(data)
        time.sleep(0.05)
        heard |= {received.gid for received in reader.take()}
        further -= another.raw_gid in heard
    print(own.raw_gid in heard, another.raw_gid in heard)
    reader.close()
"""


def test_what_a_strict_guard_relays_does_not_return_to_it(domain: object, tmp_path: Path) -> None:
    assert domain
    profile = tmp_path / "guard.xml"
    topics = ("/tf", "/tf_static")
    profile.write_text(with_partitions(FASTDDS_PROFILE_LOCALHOST, "data_reader", topics, "tfc_r"))
    env = os.environ | dict.fromkeys(PROFILE_VARIABLES, str(profile))
    output = processes.run([sys.executable, "-c", OWN_AND_ANOTHER], env=env, check=True).stdout
    assert output == "False True\n"
