import gc
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tfcompose.tf.ros import typesupport
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import TF_MESSAGE_HASH, SentTransform, encode


@pytest.fixture
def message_type() -> Any:
    """The own type; its type support is there only as long as it is."""
    return typesupport.own_type()


def _address(message_type: Any) -> int:
    return typesupport.capsule_address(message_type.__class__._TYPE_SUPPORT)


def test_the_hash_is_that_of_the_description(message_type: Any) -> None:
    address = _address(message_type)
    assert typesupport.hash_text(address) == TF_MESSAGE_HASH
    assert typesupport.type_hash(typesupport.description_json(address)) == TF_MESSAGE_HASH


def test_the_description_is_that_of_tf_message(message_type: Any) -> None:
    gc.collect()
    description = typesupport.description_json(_address(message_type))
    kind = {
        "type_id": 145,
        "capacity": 0,
        "string_capacity": 0,
        "nested_type_name": "geometry_msgs/msg/TransformStamped",
    }
    assert description["type_description"] == {
        "type_name": "tf2_msgs/msg/TFMessage",
        "fields": [{"name": "transforms", "type": kind}],
    }
    assert [each["type_name"] for each in description["referenced_type_descriptions"]] == [
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Quaternion",
        "geometry_msgs/msg/Transform",
        "geometry_msgs/msg/TransformStamped",
        "geometry_msgs/msg/Vector3",
        "std_msgs/msg/Header",
    ]


def test_another_rmw_is_refused_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        typesupport, "get_rmw_implementation_identifier", lambda: "rmw_cyclonedds_cpp"
    )
    with pytest.raises(RosError, match=r"rmw_cyclonedds_cpp\b.*\btf2_msgs\b"):
        typesupport.own_type()


@pytest.mark.parametrize("what", ["_FASTRTPS", "_INTROSPECTION", "_STAMPED"])
def test_another_layout_is_refused_with_a_sentence(
    monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    monkeypatch.setattr(
        typesupport, what, type(getattr(typesupport, what))(getattr(typesupport, what)[:-1])
    )
    with pytest.raises(RosError, match="Jazzy"):
        typesupport.own_type()


#: A tf2_msgs whose class is as rosidl makes it: its type support is loaded when rclpy asks for it.
ROSIDLS = """
from tfcompose.tf.ros.typesupport import own_type
class Metaclass_TFMessage(type):
    _TYPE_SUPPORT = None
    @classmethod
    def __import_type_support__(cls):
        cls.own = own_type()
        cls._TYPE_SUPPORT = cls.own.__class__._TYPE_SUPPORT
class TFMessage(metaclass=Metaclass_TFMessage):
    pass
"""

READS_FIRST = """
from tfcompose.tf.ros.node import PublicTFReader, open_node
with open_node("one", "/") as node:
    reader = PublicTFReader(node, "/tf", static=False)
    print(type(reader._type).__name__)
    reader.close()
"""


@pytest.mark.ros
def test_a_reader_may_be_the_first_that_uses_an_installed_tf2_msgs(
    domain: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, python: Callable[[str], str]
) -> None:
    assert domain
    package = tmp_path / "tf2_msgs"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "msg.py").write_text(ROSIDLS)
    monkeypatch.setenv(
        "PYTHONPATH",
        os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]),
    )
    assert python(READS_FIRST) == "Metaclass_TFMessage\n"


SEES = """
import rclpy, sys, time
rclpy.init(); node = rclpy.create_node("sees"); end = time.monotonic() + 50
while time.monotonic() < end and "/tf" not in dict(node.get_topic_names_and_types()):
    time.sleep(0.02)
info = node.get_publishers_info_by_topic("/tf")[0]
print(dict(node.get_topic_names_and_types())["/tf"], info.topic_type, info.topic_type_hash)
"""


@pytest.mark.ros
@pytest.mark.usefixtures("domain")
def test_another_process_sees_the_type_and_its_hash(python: Callable[[str], str]) -> None:
    with open_node("talks", "/rover") as node:
        publisher = TFPublisher(node, static=False)
        publisher.publish(
            encode([SentTransform(0, "a", "b", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])
        )
        observed = python(SEES)
    assert "['tf2_msgs/msg/TFMessage'] tf2_msgs/msg/TFMessage" in observed
    assert TF_MESSAGE_HASH in observed
