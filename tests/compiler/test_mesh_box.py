"""Boxes of mesh files, against trimesh; and the unit that a mesh is probably in."""

import struct
from pathlib import Path

import pytest

from tfcompose.cli.compiling import disk, library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.mesh_box import mesh_box
from tfcompose.compiler.meshes import read_mesh

CUBE = Path(__file__).parent / "urdf/urdfs/meshes/cube_in_m.obj"
DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="a" count="9">0 0 0 1 0 0 0 2 3</float_array><technique_common>
<accessor source="#a" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node>
<matrix>0 -10 0 5  10 0 0 0  0 0 10 0  0 0 0 1</matrix>
<node><rotate>0 0 1 90</rotate><scale>1 1 2</scale><instance_geometry url="#g"/></node>
</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>"""
TRIANGLES = [(0, 0, 0, 40, 0, 0, 0, 20, 10), (1, 1, 1, 2, 3, -7, 4, 5, 6)]


def write_mesh(folder: Path, kind: str) -> str:
    file = folder / f"part.{kind.partition(' ')[0]}"
    if kind == "dae":
        file.write_text(DAE, "utf-8")
    elif kind == "obj":
        file.write_text(CUBE.read_text("utf-8"), "utf-8")
    elif kind == "stl in text":
        corners = [triangle[i : i + 3] for triangle in TRIANGLES for i in (0, 3, 6)]
        lines = [f"vertex {x} {y}.0 {z}e0" for x, y, z in corners]
        loops = [f"outer loop\n{a}\n{b}\n{c}\nendloop" for a, b, c in (lines[:3], lines[3:])]
        facets = [f"facet normal 0 0 1\n{loop}\nendfacet" for loop in loops]
        file.write_text("\n".join(["solid part", *facets, "endsolid part\n"]), "utf-8")
    else:
        body = b"".join(struct.pack("<12f2x", 0, 0, 1, *numbers) for numbers in TRIANGLES)
        file.write_bytes(b"solid".ljust(80) + struct.pack("<I", len(TRIANGLES)) + body)
    return str(file)


@pytest.mark.parametrize("kind", ["stl", "stl in text", "obj", "dae"])
def test_the_box_of_a_mesh_is_that_of_its_triangles(kind: str, tmp_path: Path) -> None:
    file = write_mesh(tmp_path, kind)
    box = mesh_box(file)
    assert box
    for mine, theirs in zip(box, read_mesh(file, (1, 1, 1)).bounds.tolist(), strict=True):
        assert mine == pytest.approx(theirs, abs=1e-6)


@pytest.mark.parametrize(
    "content",
    [b"", b"solid\n", b"v 1 2 nan", b"<COLLADA", b"\0" * 200, b"<!ENTITY a 'a'>", b"v 1 2"],
)
@pytest.mark.parametrize("ending", ["stl", "obj", "dae", "ply"])
def test_a_broken_mesh_has_no_box(ending: str, content: bytes, tmp_path: Path) -> None:
    file = tmp_path / f"part.{ending}"
    file.write_bytes(content)
    assert mesh_box(str(file)) is None


@pytest.mark.parametrize(
    ("mesh", "advice"),
    [
        ("{uri: cube.obj, scale: 1000}", "[1, 1, 1]"),
        ("{uri: cube.obj, scale: 0.001}", "[1, 1, 1]"),
        ("small.obj", "[1000, 1000, 1000]"),
        ("cube.obj", None),
        ("mark.obj", None),
        ("{uri: cube.obj, scale: [0.5, -1, 1]}", None),
    ],
)
def test_a_mesh_in_another_unit_is_found_in_a_robot_file(
    mesh: str, advice: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    cube = CUBE.read_text("utf-8")
    Path("cube.obj").write_text(cube, "utf-8")
    mark = cube.replace("0.1", "0.0001")  # of a frame: no body is a cube of this size
    Path("mark.obj").write_text(mark, "utf-8")
    Path("small.obj").write_text(mark.replace("v 0.0001", "v 0.0002"), "utf-8")
    text = f"""tfcompose: 1
robot: r
links:
  base_link: {{visual: {{mesh: {mesh}}}}}
  top: {{parent: base_link, xyz: [0, 0, 0.5]}}
"""
    findings = [
        finding
        for finding in compile_robot(text, "r.yaml", library(), disk=disk()).findings
        if finding.code == "TF414"
    ]
    assert [finding.span.line for finding in findings if finding.span] == [4] * bool(advice)
    assert all(advice in finding.help for finding in findings if advice)
