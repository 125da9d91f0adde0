"""Edits of an overlay's text: the pose of one mount changes, and nothing else."""

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from tfcompose.spec.language.overlay_text import OverlayChange, OverlayTextError, read_overlay

ENTRY_PATH = ("sensors", "eye")
POSE = {"xyz": "[1, 2, 3]", "rpy": "[0, 0, 5 deg]"}
ENTRY = "sensors:\n  eye:\n    xyz: [1, 2, 3]\n    rpy: [0, 0, 5 deg]\n"
FRAMES = "frames:\n  a: {xyz: [0, 0, 1]}   # keep\n"
#: Before, with a pose of the eye, and without one.
CASES = {
    "no file": ("", ENTRY, "tfcompose: 1\n"),
    "comments alone": ("# mine\n", f"# mine\n{ENTRY}", "# mine\ntfcompose: 1\n"),
    "another section": (FRAMES, FRAMES + ENTRY, FRAMES),
    "comments in the entry": (
        (
            "sensors:\n  # eye\n  eye:\n    # at\n    xyz: [0, 0, 0]  # drawing\n"
            "    look: left  # c\n    options: {serial: '12'}\n  lidar: {xyz: [0, 0, 0]}\n"
        ),
        (
            "sensors:\n  # eye\n  eye:\n    # at\n    xyz: [1, 2, 3]  # drawing\n"
            "    rpy: [0, 0, 5 deg]  # c\n    options: {serial: '12'}\n  lidar: {xyz: [0, 0, 0]}\n"
        ),
        (
            "sensors:\n  # eye\n  eye:\n    # at\n    # drawing\n    # c\n"
            "    options: {serial: '12'}\n  lidar: {xyz: [0, 0, 0]}\n"
        ),
    ),
    "lists of lines": (
        (
            "sensors:\n  eye:\n    xyz:  # m\n      - 0.1\n      - 0.2\n      - 0.3\n"
            "    # after\n    rpy:\n    - 0\n    - 0\n    - 1\n"
            "  # about lidar\n  lidar:\n    xyz: [0, 0, 0]\n"
        ),
        (
            "sensors:\n  eye:\n    xyz: [1, 2, 3]  # m\n    # after\n    rpy: [0, 0, 5 deg]\n"
            "  # about lidar\n  lidar:\n    xyz: [0, 0, 0]\n"
        ),
        "sensors:\n  # m\n  # after\n  # about lidar\n  lidar:\n    xyz: [0, 0, 0]\n",
    ),
    "in braces": (
        "sensors: {eye: {look: left, options: {a: 1}}, b: {xyz: [0, 0, 0]}}\n",
        (
            "sensors: {eye: {xyz: [1, 2, 3], options: {a: 1}, rpy: [0, 0, 5 deg]}, b: {xyz: [0, 0,"
            " 0]}}\n"
        ),
        "sensors: {eye: {options: {a: 1}}, b: {xyz: [0, 0, 0]}}\n",
    ),
    "an empty entry": (
        "sensors:\n  eye:\n  b: {xyz: [0, 0, 1]}\n",
        f"{ENTRY}  b: {{xyz: [0, 0, 1]}}\n",
        "sensors:\n  b: {xyz: [0, 0, 1]}\n",
    ),
    "an alias": (
        "x-a: &a [1, 1, 1]\nsensors:\n  eye: {xyz: *a, rpy: [0, 0, 0]}\n  b: {xyz: *a}\n",
        (
            "x-a: &a [1, 1, 1]\nsensors:\n  eye: {xyz: [1, 2, 3], rpy: [0, 0, 5 deg]}\n"
            "  b: {xyz: *a}\n"
        ),
        "x-a: &a [1, 1, 1]\nsensors:\n  b: {xyz: *a}\n",
    ),
    "keys in quotes": (
        "'sensors':\n  \"eye\":\n    'xyz': [0, 0, 0]\n",
        "'sensors':\n  \"eye\":\n    'xyz': [1, 2, 3]\n    rpy: [0, 0, 5 deg]\n",
        "tfcompose: 1\n",
    ),
    "a matrix and its place": (
        (
            "sensors:\n  eye:\n    matrix:\n      - [1, 0, 0]\n      - [0, 1, 0]\n"
            "      - [0, 0, 1]\n    place: p\n"
        ),
        "sensors:\n  eye:\n    xyz: [1, 2, 3]\n    place: p\n    rpy: [0, 0, 5 deg]\n",
        "sensors:\n  eye:\n    place: p\n",
    ),
    "comments in a list": (
        (
            "sensors:\n  eye:\n    xyz:   # m\n      # ahead\n      - 1  # x\n      - 2\n"
            "      # up\n      - 3  # z\n    look: left\n    options: {serial: '# 12'}\n"
        ),
        (
            "sensors:\n  eye:\n    # ahead\n    # x\n    # up\n    xyz: [1, 2, 3]  # m  # z\n"
            "    rpy: [0, 0, 5 deg]\n    options: {serial: '# 12'}\n"
        ),
        (
            "sensors:\n  eye:\n    # m\n    # ahead\n    # x\n    # up\n    # z\n"
            "    options: {serial: '# 12'}\n"
        ),
    ),
    "comments in braces": (
        "sensors:\n  eye: {xyz: [0, # x\n    1, 2],\n    look: left, tf: driver}\n",
        "sensors:\n  # x\n  eye: {xyz: [1, 2, 3],\n    rpy: [0, 0, 5 deg], tf: driver}\n",
        "sensors:\n  # x\n  eye: {\n    tf: driver}\n",
    ),
    "a sign of comments in quotes": (
        "sensors:\n  eye:\n    calibration: [{file: 'a # b'}]   # it's\n    xyz: [0, 0, 0]\n",
        "sensors:\n  eye:\n    rpy: [0, 0, 5 deg]   # it's\n    xyz: [1, 2, 3]\n",
        "# it's\ntfcompose: 1\n",
    ),
    "no end of line": ("sensors:\n  eye:\n    look: left", ENTRY, "tfcompose: 1\n"),
}
SHARED = {
    "an anchor": "sensors:\n  eye: {xyz: &a [1, 1, 1]}\n  b: {xyz: *a}\n",
    "a merge": "x-a: &a {xyz: [1, 1, 1]}\nsensors:\n  eye: {<<: *a, rpy: [0, 0, 0]}\n",
    "an entry": "frames:\n  b: &a {xyz: [1, 1, 1]}\nsensors:\n  eye: *a\n",
}


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("case", CASES)
def test_a_pose_replaces_that_of_the_mount_alone(case: str, line_end: str) -> None:
    if "\n" not in CASES[case][0]:
        line_end = "\n"
    before, with_pose, without = (text.replace("\n", line_end) for text in CASES[case])
    overlay = read_overlay(before, "o.yaml")
    assert overlay.with_pose(ENTRY_PATH, "o.yaml", POSE).render("o.yaml") == with_pose
    assert overlay.with_pose(ENTRY_PATH, "o.yaml", {}).render("o.yaml") == without
    again = read_overlay(with_pose, "o.yaml").with_pose(ENTRY_PATH, "o.yaml", POSE)
    assert again.render("o.yaml") == with_pose


HISTORY = """\
frames: {mast: {xyz: [0, 0, 1]}}

x-adjustments:   # the poses that calibrate, nudge and prove replaced
  # the first robot
  sensors.eye:
    - {date: a, tool: nudge, who: anna, replaced: {xyz: [0, 0, 0]}}   # at the fair
    # after the crash
# by hand
    - date: b
      tool: prove   # second
      replaced: {xyz: [0, 0, 1]}
  frames.mast:  # bent
  - {tool: nudge, date: c, replaced: {}}
  # the end
"""
#: Lines of the history, and those that replace them.
HISTORY_EDITS = {
    "add": {
        "      replaced: {xyz: [0, 0, 1]}\n": (
            "      replaced: {xyz: [0, 0, 1]}\n    - {date: d, tool: t, replaced: {}}\n"
        )
    },
    "remove": {
        "    - date: b\n      tool: prove   # second\n      replaced: {xyz: [0, 0, 1]}\n": (
            "    # second\n"
        )
    },
    "replace": {
        "    - date: b\n      tool: prove   # second\n      replaced: {xyz: [0, 0, 1]}\n": (
            "    # second\n    - {date: d, tool: t, replaced: {}}\n"
        )
    },
}


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("edit", HISTORY_EDITS)
def test_a_history_changes_in_the_lines_of_its_entry(edit: str, line_end: str) -> None:
    overlay = read_overlay(HISTORY.replace("\n", line_end), "o.yaml")
    before = overlay.adjustments(ENTRY_PATH)
    assert before[0].further == {"who": "anna"}
    new = [] if edit == "remove" else [OverlayChange("d", "t", {})]
    kept = before if edit == "add" else before[:-1]
    expected = HISTORY
    for old, text in HISTORY_EDITS[edit].items():
        expected = expected.replace(old, text)
    edited = overlay.with_history(ENTRY_PATH, [*kept, *new]).render("o.yaml")
    assert edited == expected.replace("\n", line_end)
    assert read_overlay(edited, "o.yaml").adjustments(ENTRY_PATH) == (*kept, *new)


@pytest.mark.parametrize("brace", ["{sensors.eye: [%s], b: []}", "{'sensors.eye': [%s]}  # mine"])
def test_a_history_in_braces_keeps_its_keys_and_comments(brace: str) -> None:
    item = "{date: a, tool: t, replaced: {}, who: anna}"
    overlay = read_overlay(f"tfcompose: 1\nx-adjustments: {brace % item}\n", "o.yaml")
    change = OverlayChange("d", "t", {})
    rendered = overlay.with_history(("b",), [change]).render("o.yaml")
    again = read_overlay(rendered, "o.yaml")
    assert again.adjustments(ENTRY_PATH)[0].further == {"who": "anna"}
    assert again.adjustments(("b",)) == (change,)
    assert ("# mine" in rendered) == ("# mine" in brace)


@pytest.mark.parametrize("case", SHARED)
def test_a_pose_that_another_entry_shares_is_refused(case: str) -> None:
    overlay = read_overlay(SHARED[case], "o.yaml")
    with pytest.raises(OverlayTextError):
        overlay.with_pose(ENTRY_PATH, "o.yaml", POSE)


@pytest.mark.parametrize(
    "text", ["{sensors: {eye: {look: left}}}\n", "---\nframes: {a: {xyz: [0, 0, 1]}}\n...\n"]
)
def test_a_text_without_room_for_a_history_is_refused(text: str) -> None:
    overlay = read_overlay(text, "o.yaml")
    with pytest.raises(OverlayTextError):
        overlay.with_history(ENTRY_PATH, [OverlayChange("d", "t", {})]).render("o.yaml")


_NUMBERS = st.one_of(st.floats(-1e6, 1e6), st.integers(-5, 5), st.sampled_from(["7 cm", "${a}"]))
_POSES = st.dictionaries(
    st.sampled_from(["xyz", "rpy", "look"]),
    st.one_of(st.lists(_NUMBERS, min_size=3, max_size=3), st.just("left")),
    max_size=2,
)


@settings(max_examples=60, deadline=None)
@given(st.lists(_POSES, max_size=3), st.sampled_from(["", FRAMES, f"# head\n{FRAMES}"]))
def test_a_rendered_history_reads_back_unchanged(
    poses: list[dict[str, object]], text: str
) -> None:
    adjustments = tuple(
        OverlayChange(f"2026-11-28T00:00:{second:02}Z", "calibrate", {"xyz": [0, 0, 0]}, "a", pose)
        for second, pose in enumerate(poses)
    )
    overlay = read_overlay(text, "o.yaml").with_history(ENTRY_PATH, adjustments)
    rendered = overlay.render("o.yaml")
    read = read_overlay(rendered, "o.yaml")
    assert read.adjustments(ENTRY_PATH) == adjustments
    assert read.render("o.yaml") == rendered
    history = yaml.safe_load(rendered).get("x-adjustments", {"sensors.eye": []})
    assert len(history["sensors.eye"]) == len(poses)
