"""Which ports of Fast DDS's shared memory a process reads.

Who first writes to an idle one may wait for 333 ms.
"""

import os
import sys

import pytest

from tests.support import processes
from tfcompose.model.plan import Discovery, RosSettings
from tfcompose.tf.ros.environment import child_environment

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
@pytest.mark.parametrize("own", [True, False])
def test_tfcomposes_own_processes_read_no_shared_memory_and_others_do(
    domain: object, discovery: Discovery, *, own: bool
) -> None:
    assert domain
    env = child_environment(os.environ, RosSettings(discovery=discovery), own=own)
    output = processes.run([sys.executable, "-c", NODE], env=env, check=True)
    assert (output.stdout == "\n") == own, output.stdout


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
    env = child_environment(os.environ, RosSettings(discovery="localhost"), own=True)
    assert processes.run([sys.executable, "-c", APART], env=env, check=True).stdout == "1\n"
