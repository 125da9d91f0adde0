"""A scene as one page for a pull request or a ticket.

With the tree of its frames, their owners and poses.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from tfcompose.foundation.text import counted
from tfcompose.tools.view.facts import facts_of
from tfcompose.tools.view.frame_tree import FrameTree

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.model.robot import Robot
    from tfcompose.spec.load import Source

_STYLE = """<style>
.tf-frames {
  position: fixed; left: 0; top: 0; z-index: 1000; max-width: 24em; max-height: 100vh;
  overflow: auto; box-sizing: border-box; padding: 0.6em 0.9em; background: #fffe; color: #222;
  font: 13px/1.5 sans-serif
}
.tf-frames summary { cursor: pointer; white-space: nowrap }
.tf-frames p { margin: 0.2em 0 0.4em 2.2em; color: #555 }
.tf-frames i {
  display: inline-block; width: 0.8em; height: 0.8em; margin: 0 0.5em; border-radius: 0.2em
}
.tf-frames div { padding: 0.3em 0 0.5em }
</style>"""
_TITLE = "<title>Viser</title>"


def page_of(
    scene: str,
    robot: Robot,
    sources: Sequence[Source],
    colours: Mapping[str, tuple[int, int, int]],
) -> str:
    """Return the page of a scene with the frames of its robot beside it.

    Args:
        scene: the page that viser makes.
        robot: what the scene shows.
        sources: the files in which its values stand.
        colours: of the owners of edges.
    """
    owners = "".join(f"{_swatch(colour)}{escape(owner)} " for owner, colour in colours.items())
    tree = FrameTree(robot)
    rows = []
    for row in tree.rows(dict.fromkeys(tree.frames, True)):
        edge = robot.parent_edge(row.frame)
        first, *further = map(escape, facts_of(robot, sources, row.frame))
        rows.append(
            f'<details style="{row.style}">'
            f"<summary>{_swatch(colours[edge.owner]) if edge else ''}{escape(row.frame)}</summary>"
            f"<p>{'<br>'.join([first, *further])}</p></details>"
        )
    head = f"<summary><b>{escape(robot.name)}</b> · {counted(len(tree.frames), 'frame')}</summary>"
    aside = (
        f'{_STYLE}<details class="tf-frames"'
        f" open>{head}<div>{owners}</div>{''.join(rows)}</details>"
    )
    begin, end, rest = scene.rpartition("</body>")
    return begin.replace(_TITLE, f"<title>{escape(robot.name)}</title>", 1) + aside + end + rest


def _swatch(colour: tuple[int, int, int]) -> str:
    return f'<i style="background: rgb{colour}"></i>'
