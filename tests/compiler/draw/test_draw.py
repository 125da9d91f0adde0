"""Pictures contain everything once, overlap nothing, and open in other readers."""

import io
import random
import re
from collections import Counter
from dataclasses import replace
from importlib import resources
from itertools import pairwise
from typing import Any, get_args
from xml.etree import ElementTree as ET

import pydot
import pytest
from PIL import Image

from tfcompose.compiler.draw import Arrow, Graph, Group
from tfcompose.compiler.draw.arrange import Direction
from tfcompose.compiler.draw.dot import dot
from tfcompose.compiler.draw.graph import Kind, collapse_groups
from tfcompose.compiler.draw.mermaid import mermaid
from tfcompose.compiler.draw.picture import Box, Curve, Drawing, TextLine, draw
from tfcompose.compiler.draw.png import png
from tfcompose.compiler.draw.style import STYLES, width_of
from tfcompose.compiler.draw.svg import svg

DIRECTIONS = get_args(Direction)
SVG = "{http://www.w3.org/2000/svg}"
KINDS: tuple[Kind, ...] = ("static", "joint", "dynamic")
ODD = (
    "a<b>&\"c'",
    "back\\slash\\",
    "new\nline",
    "bell\x07",
    "\u202eturned",
    "底盤",
    "#35;`x`",
    "end",
    "a -> b; }",
    " ",
    "]",
)


def tree(seed: int, frames: int, *, poses: bool = False, odd: bool = False) -> Graph:
    """A tree that grows at random.

    Deep where the seed is even, with sensors, of which some carry others.
    """
    rng = random.Random(seed)
    names = [f"frame_{index}_{'x' * rng.randrange(20)}" for index in range(frames)]
    if odd:
        names[1 : 1 + len(ODD)] = ODD[: frames - 1]
    owners = [f"owner{index}" for index in range(rng.randint(1, 12))]
    arrows, groups = [], {names[0]: -1}
    for index in range(1, frames):
        low = max(0, index - 3) if seed % 2 == 0 else 0
        parent = names[rng.randrange(low, index)]
        same, new = groups[parent], len(groups) if rng.random() < 0.3 else -1
        groups[names[index]] = same if rng.random() < 0.5 else new
        pose = "xyz 0.123456 -4 5.25  rpy 0 -90 12.5 deg" if poses and rng.random() < 0.7 else ""
        rate = "50 Hz" if rng.random() < 0.2 else ""
        arrows.append(
            Arrow(parent, names[index], rng.choice(KINDS), rng.choice(owners), rate, pose)
        )
    rng.shuffle(arrows)
    members: dict[int, list[str]] = {}
    for name, group in groups.items():
        if group >= 0:
            members.setdefault(group, []).append(name)
    return Graph(
        f"robot <{seed}>",
        tuple(names),
        tuple(arrows),
        tuple(
            Group(f"sensor{index} · vendor/model", tuple(frames_of_group))
            for index, frames_of_group in members.items()
        ),
        tuple(owners),
    )


def parsed(drawing: Drawing) -> ET.Element:
    return ET.fromstring(svg(drawing))  # noqa: S314 (our own)


def opened(drawing: Drawing) -> Image.Image:
    """The PNG, as an independent reader decodes it."""
    image = Image.open(io.BytesIO(png(drawing)))
    image.load()
    return image


def read_dot(graph: Graph) -> Any:
    return (pydot.graph_from_dot_data(dot(graph)) or [])[0]


FAMILY = [
    (seed, frames, poses)
    for seed in range(6)
    for frames in (1, 2, 9, 100)
    for poses in (False, True)
]


def boxes_of(drawing: Drawing, *prefixes: str) -> list[Box]:
    return [
        shape
        for shape in drawing.shapes
        if isinstance(shape, Box) and shape.style.startswith(prefixes)
    ]


def overlaps(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
    slack = 1e-6
    return (
        first[0] < second[2] - slack
        and second[0] < first[2] - slack
        and first[1] < second[3] - slack
        and second[1] < first[3] - slack
    )


def around(shape: Box | TextLine) -> tuple[float, float, float, float]:
    if isinstance(shape, Box):
        return shape.x, shape.y, shape.x + shape.width, shape.y + shape.height
    left = shape.x - shape.width / 2 if shape.middle else shape.x
    size = STYLES[shape.style].size
    return left, shape.y - 0.75 * size, left + shape.width, shape.y + 0.2 * size


@pytest.mark.parametrize(("seed", "frames", "poses"), FAMILY)
def test_no_boxes_and_no_texts_overlap_and_all_is_on_the_paper(
    seed: int, frames: int, *, poses: bool
) -> None:
    for direction in DIRECTIONS:
        nothing_overlaps(draw(tree(seed, frames, poses=poses), direction), frames)


def nothing_overlaps(drawing: Drawing, frames: int) -> None:
    texts = [around(shape) for shape in drawing.shapes if isinstance(shape, TextLine)]
    boxes = [around(box) for box in boxes_of(drawing, "box", "root")]
    assert len(boxes) == frames
    for some in (texts, boxes):
        some.sort()
        for index, picture in enumerate(some):
            assert not any(overlaps(picture, second) for second in some[index + 1 :])
    for left, top, right, bottom in (*texts, *boxes):
        assert left > 0
        assert top > 0
        assert right < drawing.width
        assert bottom < drawing.height


@pytest.mark.parametrize(("seed", "frames", "poses"), FAMILY)
def test_the_area_of_a_group_holds_its_frames_entirely_and_crosses_no_box(
    seed: int, frames: int, *, poses: bool
) -> None:
    graph = tree(seed, frames, poses=poses)
    for direction in DIRECTIONS:
        areas_hold_their_frames(graph, draw(graph, direction))


def areas_hold_their_frames(graph: Graph, drawing: Drawing) -> None:
    areas = [around(box) for box in boxes_of(drawing, "group")]
    boxes = {
        name: around(box)
        for name, box in zip(_names(drawing), boxes_of(drawing, "box", "root"), strict=True)
    }
    for box in boxes.values():
        for area in areas:
            inside = (
                area[0] <= box[0] and area[1] <= box[1] and area[2] >= box[2] and area[3] >= box[3]
            )
            assert inside or not overlaps(box, area)
    for frame in (frame for group in graph.groups for frame in group.frames):
        assert any(overlaps(boxes[frame], area) for area in areas)


def chain(frames: int) -> Graph:
    names = tuple(f"link_{index}_of_an_arm" for index in range(frames))
    arrows = tuple(
        Arrow(parent, child, "joint", "joints", pose="xyz 0.1 0 0")
        for parent, child in pairwise(names)
    )
    return Graph("arm", names, arrows)


def test_a_long_chain_goes_down_by_itself_and_others_to_the_right() -> None:
    down, right = draw(chain(13)), draw(chain(13), "right")
    assert down == draw(chain(13), "down")
    assert down.width < right.width / 2
    assert max(down.width, down.height) < 2 * min(down.width, down.height)
    assert draw(chain(4)) == draw(chain(4), "right")
    assert "rankdir=TB" in dot(chain(4), is_down=True)
    assert mermaid(chain(4), is_down=True).startswith("flowchart TD")


def broad(cameras: int) -> Graph:
    arrows = [Arrow("odom", "base_link", "dynamic", "drive")]
    for index in range(cameras):
        names = ("base_link", f"cam{index}_link", f"cam{index}_frame", f"cam{index}_optical_frame")
        arrows += [Arrow(parent, child, "static", "static") for parent, child in pairwise(names)]
    groups = tuple(
        Group(f"cam{i}", (f"cam{i}_link", f"cam{i}_frame", f"cam{i}_optical_frame"))
        for i in range(cameras)
    )
    return Graph("broad", ("odom",), tuple(arrows), groups)


def test_a_tall_picture_is_in_columns_by_itself_and_no_taller_than_wide() -> None:
    drawing = draw(broad(60))
    assert drawing == draw(broad(60), "columns")
    assert drawing.height < 1.1 * drawing.width < draw(broad(60), "right").height
    assert draw(broad(6)) == draw(broad(6), "right")
    assert draw(chain(4), "columns") == draw(chain(4), "right")


@pytest.mark.parametrize(("seed", "frames", "poses"), FAMILY)
def test_in_columns_no_edge_to_a_child_of_the_trunk_crosses_a_box(
    seed: int, frames: int, *, poses: bool
) -> None:
    graph = tree(seed, frames, poses=poses)
    drawing = draw(graph, "columns")
    boxes = [around(box) for box in boxes_of(drawing, "box", "root")]
    for curve in (
        shape for shape in drawing.shapes if isinstance(shape, Curve) and len(shape.points) > 4
    ):
        for (x1, y1), (x2, y2) in pairwise(curve.points):
            line = (min(x1, x2), min(y1, y2), max(x1, x2), max(y1, y2))
            assert not any(overlaps(line, box) for box in boxes)


def test_the_title_of_a_collapsed_picture_counts_the_frames_of_the_robot() -> None:
    texts = [
        shape.text
        for shape in draw(collapse_groups(broad(3))).shapes
        if isinstance(shape, TextLine)
    ]
    assert "11 frames · 10 edges · 6 frames inside sensors not shown" in texts
    assert "static (9 edges)" in texts


def test_downwards_a_child_is_below_its_parent_and_to_its_right() -> None:
    graph = tree(3, 40)
    drawing = draw(graph, "down")
    boxes = {
        name: around(box)
        for name, box in zip(_names(drawing), boxes_of(drawing, "box", "root"), strict=True)
    }
    assert all(boxes[arrow.parent][0] < boxes[arrow.child][0] for arrow in graph.arrows)
    assert all(boxes[arrow.parent][3] < boxes[arrow.child][1] for arrow in graph.arrows)


def test_a_collapsed_sensor_is_its_mount_and_what_leads_to_other_frames() -> None:
    edges = ("base cam", "cam lens", "lens optical", "cam imu", "lens filter", "base laser")
    pairs = [edge.split() for edge in edges]
    arrows = tuple(Arrow(a, b, "static", "static", "5 Hz" if b == "cam" else "") for a, b in pairs)
    frames = ("base", "cam", "lens", "optical", "imu", "filter", "laser")
    groups = (Group("camera", ("cam", "lens", "optical", "imu")), Group("laser", ("laser",)))
    graph = collapse_groups(Graph("robot", frames, arrows, groups))
    assert graph.frames == ("base", "cam", "lens", "filter", "laser")
    assert [(arrow.parent, arrow.child, arrow.detail) for arrow in graph.arrows] == [
        ("base", "cam", "5 Hz +2"),
        ("cam", "lens", ""),
        ("lens", "filter", ""),
        ("base", "laser", ""),
    ]
    assert [group.frames for group in graph.groups] == [("cam", "lens"), ("laser",)]
    nothing_overlaps(draw(graph), len(graph.frames))


def _names(drawing: Drawing) -> list[str]:
    return [
        shape.text
        for shape in drawing.shapes
        if isinstance(shape, TextLine) and shape.style == "name"
    ]


@pytest.mark.parametrize("seed", range(6))
def test_every_frame_and_every_edge_is_in_the_svg_once(seed: int) -> None:
    graph = tree(seed, 60)
    root = parsed(draw(graph))
    names = Counter(text.text for text in root.iter(f"{SVG}text") if text.get("class") == "name")
    assert names == Counter(graph.frames)
    titles = Counter(path[0].text for path in root.iter(f"{SVG}path") if len(path))
    edges = Counter(str(title).partition(": ")[0] for title in titles.elements())
    assert edges == Counter(f"{arrow.parent} → {arrow.child}" for arrow in graph.arrows)


def test_what_is_no_tree_is_drawn_with_every_edge() -> None:
    arrows = (
        Arrow("map", "odom", "dynamic", "slam"),
        Arrow("odom", "base", "dynamic", "ekf"),
        Arrow("base", "odom", "dynamic", "rogue"),
        Arrow("other", "base", "dynamic", "rogue"),
        Arrow("a", "b", "dynamic", "rogue"),
        Arrow("b", "a", "dynamic", "rogue"),
        Arrow("self", "self", "static", "rogue"),
        Arrow("base", "tool", "dynamic", "changer"),
        Arrow("rack", "tool", "dynamic", "changer", alternative=True),
    )
    drawing = draw(Graph("live", ("map", "alone"), arrows, (Group("g", ("b", "a")),)))
    root = parsed(drawing)
    titles = [
        str(path[0].text).partition(": ")[0] for path in root.iter(f"{SVG}path") if len(path)
    ]
    assert sorted(titles) == sorted(f"{arrow.parent} → {arrow.child}" for arrow in arrows)
    assert sorted(_names(drawing)) == [
        "a",
        "alone",
        "b",
        "base",
        "map",
        "odom",
        "other",
        "rack",
        "self",
        "tool",
    ]


def test_a_graph_without_frames_is_a_picture_too() -> None:
    drawing = draw(Graph("nothing", (), ()))
    parsed(drawing)
    assert opened(drawing).size == pytest.approx((2 * drawing.width, 2 * drawing.height), abs=2)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # pydot's, about pyparsing
def test_odd_names_are_well_formed_and_escaped_in_every_format() -> None:
    graph = tree(3, 20, odd=True)
    drawing = draw(graph)
    root = parsed(drawing)
    names = [text.text for text in root.iter(f"{SVG}text") if text.get("class") == "name"]
    assert {
        "a<b>&\"c'",
        "back\\slash\\",
        "new\\nline",
        "bell\\x07",
        "\\u202eturned",
        "底盤",
    } <= set(names)
    read = read_dot(graph)
    assert len(read.get_edges()) == len(graph.arrows)
    assert opened(drawing).size == pytest.approx((2 * drawing.width, 2 * drawing.height), abs=2)
    labels = re.findall(r'\["(.*)"\](?::::owner\d+)?$', mermaid(graph), re.MULTILINE)
    assert len(labels) == len(graph.frames) + len(graph.groups)
    assert not [label for label in labels if re.search(r'["`<>]|#(?!\d+;)', label)]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # as above
@pytest.mark.parametrize("seed", range(2))
def test_graphviz_text_has_each_frame_edge_and_group(seed: int) -> None:
    graph = tree(seed, 40, poses=True)
    read = read_dot(graph)
    nodes = [node.get_name().strip('"') for node in read.get_nodes()]
    assert Counter(nodes) == Counter((*graph.frames, "node", "edge"))
    edges = Counter(
        (edge.get_source().strip('"'), edge.get_destination().strip('"'))
        for edge in read.get_edges()
    )
    assert edges == Counter((arrow.parent, arrow.child) for arrow in graph.arrows)
    assert len(read.get_subgraphs()) == len(graph.groups)
    moving = sum(edge.get_style() == "dashed" for edge in read.get_edges())
    assert moving == sum(arrow.kind != "static" for arrow in graph.arrows)


def test_mermaid_text_has_each_edge_once_and_draws_moving_ones_otherwise() -> None:
    graph = tree(5, 40)
    lines = mermaid(graph).splitlines()
    assert lines[0] == "flowchart LR"
    assert sum(" --> " in line or " -->|" in line for line in lines) == sum(
        arrow.kind == "static" for arrow in graph.arrows
    )
    assert sum(" -.->|" in line for line in lines) == sum(
        arrow.kind != "static" for arrow in graph.arrows
    )
    styled = [
        int(number)
        for line in lines
        if "linkStyle" in line
        for number in line.split()[1].split(",")
    ]
    assert sorted(styled) == list(range(len(graph.arrows)))


def test_a_png_shows_boxes_and_characters_where_the_drawing_has_them() -> None:
    drawing = draw(tree(2, 9))
    image = opened(drawing).convert("RGB")
    assert image.size == pytest.approx((2 * drawing.width, 2 * drawing.height), abs=2)
    assert image.getpixel((4, 4)) == (255, 255, 255)
    for badge in boxes_of(drawing, "badge"):
        corner = image.getpixel(
            (round(2 * (badge.x + 3)), round(2 * (badge.y + badge.height - 3)))
        )
        assert corner == _rgb(STYLES[badge.style].fill[0])
    for text in (
        shape for shape in drawing.shapes if isinstance(shape, TextLine) and shape.style == "name"
    ):
        left, top, right, bottom = (round(2 * edge) for edge in around(text))
        dark = sum(image.crop((left, top, right, bottom)).convert("L").histogram()[:80])
        assert dark > 20, text.text


def _rgb(digits: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(digits))


def test_a_very_large_drawing_gives_an_image_of_bounded_size() -> None:
    drawing = replace(draw(tree(1, 3)), width=6_000.0, height=5_000.0)
    width, height = opened(drawing).size
    assert 30e6 < width * height < 51e6


def test_the_image_of_a_very_long_chain_is_one_that_viewers_open() -> None:
    drawing = replace(draw(tree(1, 3)), width=40_000.0)
    width, height = opened(drawing).size
    assert width == pytest.approx(32_000, abs=2)
    assert height == pytest.approx(drawing.height * 32_000 / 40_000, abs=2)


def test_the_same_graph_gives_the_same_bytes() -> None:
    first, second = (draw(tree(4, 50, poses=True)) for _ in range(2))
    assert svg(first) == svg(second)
    assert png(first) == png(second)


def test_characters_are_as_wide_as_adobe_says_that_helvetica_is() -> None:
    """Matplotlib carries Adobe's table: ``C 32 ; WX 278 ; N space ; …``."""
    fonts = resources.files("matplotlib") / "mpl-data" / "fonts" / "pdfcorefonts"
    lines = re.findall(
        r"^C (\d+) ; WX (\d+) ;", (fonts / "Helvetica.afm").read_text(), re.MULTILINE
    )
    widths = {chr(int(code)): int(width) for code, width in lines if 32 <= int(code) < 127}
    widths |= {"'": 191, "`": 333}  # where Adobe's own encoding has curved ones
    assert len(widths) == 95
    assert {char: width_of(char, 1000.0) for char in widths} == widths


def _contrast(first: str, second: str) -> float:
    """The ratio of luminances as WCAG 2 defines it."""
    lights = []
    for digits in (first, second):
        parts = [part / 255 for part in bytes.fromhex(digits)]
        red, green, blue = [
            part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
        ]
        lights.append(0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05)
    return max(lights) / min(lights)


@pytest.mark.parametrize("night", [0, 1])
@pytest.mark.parametrize("index", range(7))
def test_texts_and_lines_stand_out_from_what_is_behind_them(index: int, night: int) -> None:
    """WCAG 2: 4.5 for text, 3 for lines and for the bold numbers, which the legend repeats."""
    box, number = STYLES[f"box{index}"], STYLES[f"number{index}"]
    for text in ("name", "more"):
        assert _contrast(STYLES[text].fill[night], box.fill[night]) >= 4.5
    assert _contrast(box.stroke[night], STYLES["group"].fill[night]) >= 3
    assert _contrast(number.fill[night], STYLES[f"badge{index}"].fill[night]) >= 3
