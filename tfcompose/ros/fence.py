"""The fence of a strict plan: a DDS partition of its own for what the plan's processes send on TF.

Fast DDS reads it from a file of profiles that the environment names: a writer, or reader, of a topic takes the profile
of the topic's name. Only writers of children are moved, so their listeners stay where everybody's are. The guard's
reader is in both places. A node's own settings of quality of service are not touched.

This module imports no ROS.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.ros.environment import PROFILE_VARIABLES, RosError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_EMPTY = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <profiles>
  </profiles>
</dds>
"""
_END = "</profiles>"
_PROFILE = """\
    <{kind} profile_name="{topic}">
      <propertiesPolicy>
        <properties>
          <property>
            <name>partitions</name>
            <value>{partitions}</value>
          </property>
        </properties>
      </propertiesPolicy>
    </{kind}>
"""


def can_fence(env: Mapping[str, str]) -> bool:
    """Return whether the processes' rmw knows partitions: rmw_fastrtps, which is the default."""
    return (env.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp").startswith("rmw_fastrtps")


def profile(env: Mapping[str, str], topics: Sequence[str], partition: str, *, reads: bool) -> str:
    """Return the text of a profile file that puts the writers of these topics into the partition.

    With ``reads`` it opens the readers of these topics to the partition as well as to everybody's. What the file that
    ``env`` names holds stays.

    Raises:
        RosError: if that file cannot be read, or says something about these topics itself.
    """
    file = next((env[name] for name in PROFILE_VARIABLES if env.get(name)), None)
    try:
        text = Path(file).read_text(encoding="utf-8") if file else _EMPTY
    except (OSError, UnicodeDecodeError) as error:
        raise RosError(f"the profile file {file} cannot be read: {error}") from None
    at = text.rfind(_END)
    kind = "data_reader" if reads else "data_writer"
    profiles = set(re.findall(rf"<{kind}\s[^>]*profile_name\s*=\s*[\"']([^\"']*)[\"']", text))
    if at < 0 or profiles & set(topics):
        why = "says what its writers of TF do" if profiles else "holds no profiles"
        raise RosError(f"the profile file {file} {why}: guard: strict cannot add to it")
    partitions = f";{partition}" if reads else partition
    added = "".join(_PROFILE.format(kind=kind, topic=topic, partitions=partitions) for topic in dict.fromkeys(topics))
    return text[:at].rstrip() + "\n" + added + "  " + text[at:]
