"""Panel of frames at the left of the scene: a tree to search, select, open, close and hide.

viser needs seconds to create a control for each of a thousand frames. Therefore the tree is a
single HTML element. A click in the tree changes the text of a hidden field below it, and viser
reports this text.
"""

from __future__ import annotations

import json
import re
import threading
from html import escape
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.text import plural
from tfcompose.tools.view.frame_tree import FrameTree

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import viser

    from tfcompose.model.robot import Robot
    from tfcompose.tools.view.choices import Choices
    from tfcompose.tools.view.frame_tree import Row

    Colour = tuple[int, int, int]

_WIDTH_PX = 300
_STYLE = """<style>
div:has(> div > .tf-frames) > div:first-child {
  position: sticky; top: 0; z-index: 1; padding-top: 0.5em; background: var(--mantine-color-body) }
div:has(> .tf-frames) + div { display: none }
.tf-frames { padding: 0 0.5em 0.7em; font-size: 0.85em; line-height: 1.55 }
.tf-frames:focus { outline: none }
.tf-frames button { all: unset; cursor: pointer; box-sizing: border-box }
.tf-frames button:focus-visible { outline: 2px solid #228be6 }
.tf-frames header { color: #868e96; padding: 0 0.3em 0.4em }
.tf-frames header button { color: #1971c2 }
.tf-frames header button:hover { text-decoration: underline }
.tf-row { display: flex; align-items: center; border-radius: 0.25em }
.tf-row:hover { background: #8080801c }
.tf-row[aria-selected=true] { background: #228be62e; font-weight: 600 }
.tf-row > i { flex: none; width: 1.2em; text-align: center; font-style: normal }
.tf-row > i button { width: 100% }
.tf-row > input {
  flex: none; width: 0.95em; height: 0.95em; margin: 0 0.4em 0 0.1em; cursor: pointer
}
.tf-row > button { flex: 1; min-width: 0; overflow-wrap: anywhere }
.tf-row.tf-hidden > button { opacity: 0.45 } .tf-row.tf-wrong > button { color: #dc1e1e }
.tf-row button b { color: #e8590c }
.tf-row mark { background: #ffd43b80; color: inherit }
</style>"""
#: JavaScript that writes [action, frame, time] into the hidden field. The time makes each text
#: different, because viser reports only changes.
_SEND = """
const send = (what, frame) => {
  const field = this.parentElement.nextElementSibling.querySelector('input');
  const text = JSON.stringify([what, frame, Date.now()]);
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(field, text);
  field.dispatchEvent(new Event('input', {bubbles: true}));
};"""
_CLICKED = (
    _SEND
    + """
const clicked = event.target.closest('[data-does]'), row = event.target.closest('[data-frame]');
this.parentElement.dataset.hasKeys = '';
if (clicked) send(clicked.dataset.does, row ? row.dataset.frame : '');"""
)
_PRESSED = (
    _SEND
    + """
const rows = [...this.querySelectorAll('[data-frame]')];
const at = rows.findIndex(row => row.ariaSelected === 'true');
const step = {ArrowDown: 1, ArrowUp: -1}[event.key];
const opens = {ArrowRight: 'false', ArrowLeft: 'true'}[event.key];
if (step || opens) {
  event.preventDefault();
  event.stopPropagation();
  this.parentElement.dataset.hasKeys = '';
  const next = rows[at + step];
  if (next) send('select', next.dataset.frame);
  if (opens && at >= 0 && rows[at].ariaExpanded === opens) send('open', rows[at].dataset.frame);
}"""
)
#: JavaScript that notes when the tree loses the keyboard focus to another element. It ignores the
#: replacement of the tree.
_LEFT = """
const place = this.parentElement;
setTimeout(() => { if (this.isConnected) delete place.dataset.hasKeys })"""
#: JavaScript that runs when the tree is put into the page. It is in ``onerror`` of an image,
#: because the page does not run scripts of inserted HTML. It scrolls to the selected row or the
#: first match, gives the tree the keyboard focus if the replaced tree had it, and sets the title
#: of the window.
_PLACED = """<img hidden src="data:," onerror="
document.title = this.dataset.robot;
const tree = this.closest('.tf-frames'), selected = tree.querySelector('[aria-selected=true]');
const row = this.dataset.scrolls === 'true' && (selected || tree.querySelector('mark'));
if (row) row.scrollIntoView({block: 'nearest'});
const isFree = document.activeElement === document.body;
if (isFree && 'hasKeys' in tree.parentElement.dataset) tree.focus({preventScroll: true})"
 data-robot="ROBOT" data-scrolls="SCROLLS">"""
_NO_OWNER = (134, 142, 150)


class TreePanel:
    """Shows the frames of a robot as a tree.

    ``gui`` is the part of the page for the tree. ``colours`` are the colours of owners. The panel
    reads the user's choices from ``choices`` and stores them there.
    """

    def __init__(
        self, gui: viser.GuiApi, robot: Robot, colours: Mapping[str, Colour], choices: Choices
    ) -> None:
        self.tree = FrameTree(robot)
        self._robot = escape(robot.name)
        self._choices = choices
        self._lock = threading.RLock()
        self._wrong: frozenset[str] = frozenset()
        self._moved: frozenset[str] = frozenset()
        self._on_select: list[Callable[[], None]] = []
        self._on_show: list[Callable[[], None]] = []
        self._colours = dict.fromkeys(robot.frames, _NO_OWNER)
        self._titles = {frame: f"{frame} is a root" for frame in robot.frames}
        for edge in reversed(robot.edges):  # of several parents the first
            self._colours[edge.child] = colours[edge.owner]
            self._titles[edge.child] = (
                f"{edge.child} in {edge.parent}, {edge.kind}, by {edge.owner}"
            )
        if choices.selected not in robot.frames:
            choices.selected = self.tree.frames[0]
        choices.is_open |= self.tree.open_to(choices.selected)
        panel = gui.add_panel()
        with panel.add_tab("Frames"):
            self._search: Any = gui.add_text("search", choices.search)
            self._html = gui.add_html(self.content(scrolls=True))
            self._clicked: Any = gui.add_text("", "")
        panel.dock_left()
        panel.set_width(_WIDTH_PX)
        self._search.on_update(lambda _: self.search(self._search.value))
        self._clicked.on_update(lambda _: self._click(*json.loads(self._clicked.value)))

    @property
    def hidden(self) -> set[str]:
        """The hidden frames."""
        return self.tree.hidden_frames(self._choices.is_shown)

    def on_select(self, call: Callable[[], None]) -> None:
        """Call a function when another frame is selected."""
        self._on_select.append(call)

    def on_show(self, call: Callable[[], None]) -> None:
        """Call a function when frames are hidden or shown."""
        self._on_show.append(call)

    def select(self, frame: str) -> None:
        """Select a frame, and open the tree down to it."""
        with self._lock:
            self._choices.selected = frame
            self._choices.is_open |= self.tree.open_to(frame)
            self._refresh(scrolls=True)
        for call in self._on_select:
            call()

    def search(self, search: str) -> None:
        """Show the frames whose names contain these words, and all frames above them.

        If the match is unambiguous, select the frame.
        """
        with self._lock:
            self._choices.search = search
            if self._search.value != search:
                self._search.value = search
            matches = self.tree.matches(search)
            frame = search if search in matches else matches.pop() if len(matches) == 1 else None
            self._refresh(scrolls=True)
        if frame is not None and frame != self._choices.selected:
            self.select(frame)

    def show(self, frame: str, *, is_visible: bool) -> None:
        """Show or hide a frame with all frames below it."""
        self._show(self.tree.show(frame, self._choices.is_shown, is_visible=is_visible))

    def _show(self, is_shown: dict[str, bool]) -> None:
        with self._lock:
            self._choices.is_shown = is_shown
            self._refresh()
        for call in self._on_show:
            call()

    def mark(self, wrong: frozenset[str]) -> None:
        """Mark frames in red if their edges have errors."""
        with self._lock:
            if wrong != self._wrong:
                self._wrong = wrong
                self._refresh()

    def mark_moved(self, moved: frozenset[str]) -> None:
        """Mark frames that were moved and not saved with a dot."""
        with self._lock:
            if moved != self._moved:
                self._moved = moved
                self._refresh()

    def _open(self, is_open: dict[str, bool]) -> None:
        with self._lock:
            self._choices.is_open |= is_open
            self._refresh()

    def _click(self, does: str, frame: str, _when: float) -> None:
        """Handle a click in the page."""
        frames = self.tree.frames
        if does == "open all":
            self._open(dict.fromkeys(frames, True))
        elif does == "close all":
            self._open(dict.fromkeys(frames, False))
        elif does == "show all":
            self._show({})
        elif frame not in frames:
            return  # a frame of a robot that is no longer shown
        elif does == "select":
            self.select(frame)
        elif does == "open":
            self._open({frame: not self.tree.is_open(frame, self._choices.is_open)})
        elif does == "show":
            self.show(frame, is_visible=frame in self.hidden)

    def _refresh(self, *, scrolls: bool = False) -> None:
        self._html.content = self.content(scrolls=scrolls)

    def content(self, *, scrolls: bool = False) -> str:
        """Return the tree as HTML.

        If ``scrolls``, the page scrolls to the selected frame or the first match.
        """
        choices, hidden = self._choices, self.hidden
        terms = re.compile(
            "|".join(map(re.escape, choices.search.split())) or r"(?!)", re.IGNORECASE
        )
        rows = "".join(
            self._row(row, terms, is_hidden=row.frame in hidden)
            for row in self.tree.rows(choices.is_open, choices.search)
        )
        count = plural(len(self.tree.frames), "frame")
        if choices.search.strip():
            count = f"{len(self.tree.matches(choices.search))} of {count}"
        does = ("open all", "close all", "show all") if hidden else ("open all", "close all")
        buttons = (f'<button data-does="{action}">{action}</button>' for action in does)
        header = f"<header>{' · '.join([count, *buttons])}</header>"
        placed = _PLACED.replace("SCROLLS", str(scrolls).lower()).replace("ROBOT", self._robot)
        tree = f'<div role="tree">{rows}</div>{placed}'
        handlers = (
            f'onclick="{escape(_CLICKED)}" onkeydown="{escape(_PRESSED)}" onblur="{escape(_LEFT)}"'
        )
        return f'{_STYLE}<div class="tf-frames" tabindex="0" {handlers}>{header}{tree}</div>'

    def _row(self, row: Row, terms: re.Pattern[str], *, is_hidden: bool) -> str:
        frame, title = row.frame, escape(self._titles[row.frame])
        classes = "tf-row" + " tf-hidden" * is_hidden + " tf-wrong" * (frame in self._wrong)
        selected = str(frame == self._choices.selected).lower()
        opens = (
            ""
            if row.is_open is None
            else f'<button data-does="open">{"▾" if row.is_open else "▸"}</button>'
        )
        moved = '<b title="moved, not saved"> ●</b>' if frame in self._moved else ""
        expanded = "" if row.is_open is None else f' aria-expanded="{str(row.is_open).lower()}"'
        return (
            f'<div class="{classes}" role="treeitem" aria-level="{row.depth + 1}"'
            f' aria-selected="{selected}"{expanded} data-frame="{escape(frame)}"'
            f' style="{row.style}"><i>{opens}</i><input type="checkbox"'
            f' data-does="show"{"" if is_hidden else " checked"} style="accent-color:'
            f' rgb{self._colours[frame]}" title="show it and what is below"><button'
            f' data-does="select" title="{title}">{_mark(frame, terms)}{moved}</button></div>'
        )


def _mark(name: str, terms: re.Pattern[str]) -> str:
    """Return a name as HTML in which the searched words are marked."""
    parts, end = [], 0
    for match in terms.finditer(name):
        parts += [escape(name[end : match.start()]), f"<mark>{escape(match[0])}</mark>"]
        end = match.end()
    return "".join([*parts, escape(name[end:])])
