"""Relative mesh addresses mean the folder of the build, and only there.

Who hears the description gets whole ones.
"""

import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr

from hypothesis import given
from hypothesis import strategies as st

from tfcompose.model.files import with_absolute_addresses

FOLDER = Path("/builds/a b & <c>/rover")


def address(filename: str) -> str:
    urdf = (
        '<robot name="r"><link name="mesh filename="/><mesh scale="1 1 1"'
        f" filename={quoteattr(filename)}/></robot>"
    )
    urdf = urdf.replace('name="mesh filename="/', 'name="../a"/')
    root = ET.fromstring(with_absolute_addresses(urdf, FOLDER))  # noqa: S314 (ours)
    assert [link.get("name") for link in root.iter("link")] == ["../a"]
    return str(next(root.iter("mesh")).get("filename"))


def test_a_relative_path_becomes_the_file_that_it_means() -> None:
    assert address("../../meshes/a b.stl") == "file:///builds/meshes/a%20b.stl"
    assert unquote(address('x & "y" <z>.stl')) == f'file://{FOLDER}/x & "y" <z>.stl'


def test_other_addresses_stay_as_they_are() -> None:
    for full in (
        "package://a/b.stl",
        "file:///a/b.stl",
        "/a/b.stl",
        "http://a/b.stl",
        "model://a",
    ):
        assert address(full) == full


def test_a_texture_is_addressed_too_and_nothing_else_changes() -> None:
    urdf = (
        '<material name="m"><texture filename="../t.png"/></material><plugin filename="libx.so"/>'
    )
    expected = urdf.replace("../t.png", "file:///builds/a%20b%20%26%20%3Cc%3E/t.png")
    assert with_absolute_addresses(urdf, FOLDER) == expected


@given(st.text(st.characters(blacklist_categories=("Cs", "Cc")), min_size=1, max_size=12))
def test_what_is_sent_stays_xml(name: str) -> None:
    assert address(f"m/{name}.stl")
