"""Addresses of topics, commands, codes and keys in the site, for links in texts."""

from __future__ import annotations

import posixpath
import re
from functools import cache
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import code_page
from tfcompose.spec.language.reference import sections_with_key

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

#: The topic whose page lists all codes.
CODES = "codes"
#: Texts that become links: ``tfcompose help sensors.place``; ``tfcompose lint robots
#: --untrusted``, also without ``tfcompose``; ``restart: on-failure``; ``guard: {unknown_edges:
#: …}``.
_HELP = re.compile(r"tfcompose help ([\w.]+)")
_COMMAND = re.compile(r"(?:tfcompose )?([a-z]+)(?: (.*))?", re.DOTALL)
_OPTION = re.compile(r"(?<!\S)--[a-z-]+")
_SETTING = re.compile(r"(\w+(?:\.\w+)*):(?:\s+(?:\{(\w+):)?.*)?", re.DOTALL)
_KEY = re.compile(r"\w+(?:\.\w+)*")


def key_set_by(text: str) -> str:
    """Return the key that a text sets, as in ``stop: {…}``; empty if it sets none."""
    match = _SETTING.fullmatch(text)
    return match[1] if match else ""


def topic_path(name: str) -> str:
    """Return the path of a topic's page."""
    return f"{CODES}/index.html" if name == CODES else f"topics/{name}.html"


def command_path(name: str) -> str:
    """Return the path of a command's page."""
    return f"commands/{name}.html"


def keys_path(language: str) -> str:
    """Return the path of the page with the keys of a language."""
    return f"keys/{language}.html"


def key_anchor(section: str, key: str) -> str:
    """Return the anchor of a section's key on the page of its language."""
    return f"{section.lower()}.{key}"


def relative(address: str, page: str) -> str:
    """Return an address of the site relative to a page."""
    path, hash_, anchor = address.partition("#")
    if path == page:
        return f"#{anchor}"
    return f"{posixpath.relpath(path, posixpath.dirname(page))}{hash_}{anchor}"


class Addresses:
    """Finds the page that a text names.

    An address is a path in the site, and may end with ``#`` and an anchor.
    """

    def __init__(
        self,
        topics: Collection[str],
        commands: Mapping[str, Collection[str]],
        codes: Collection[str],
    ) -> None:
        """Set the names that have pages: topics, commands with their options, and codes."""
        self._topics = topics
        self._commands = commands
        self._codes = codes

    def of_code(self, text: str) -> str:
        """Return the address of a code; empty if there is none."""
        return code_page(text) if text in self._codes else ""

    def of_topic(self, name: str) -> str:
        """Return the address of a topic; empty if there is none."""
        return topic_path(name) if name in self._topics else ""

    def of_code_span(self, text: str, keys: Collection[str] | None = None) -> str:
        """Return the address for a text between backticks; empty if it names no page.

        In a page about the robot file, a single word can be a key. ``keys`` are the keys that the
        page sets, as in ``stop: {…}``. If a word is both a command and a key, it counts as a key
        only if it is one of ``keys``.
        """
        if match := _HELP.fullmatch(text):
            return self._of_help(match[1])
        is_key = keys is not None and (text in keys or text not in self._commands)
        key = _key_address(text) if _KEY.fullmatch(text) else ""
        if address := self.of_code(text) or (key if is_key or "." in text else ""):
            return address
        address = self._of_command(text) or self._of_setting(text)
        return address or ("" if key else self.of_topic(text))

    def _of_help(self, name: str) -> str:
        return (
            self.of_topic(name)
            or (command_path(name) if name in self._commands else "")
            or _key_address(name)
        )

    def _of_command(self, text: str) -> str:
        match = _COMMAND.fullmatch(text)
        if not match or match[1] not in self._commands:
            return ""
        name, rest = match[1], match[2] or ""
        if rest and not text.startswith("tfcompose ") and "--" not in rest:
            return ""
        options = [option for option in _OPTION.findall(rest) if option in self._commands[name]]
        return command_path(name) + (f"#{options[0]}" if len(options) == 1 else "")

    def _of_setting(self, text: str) -> str:
        match = _SETTING.fullmatch(text)
        if not match:
            return ""
        deeper = _key_address(f"{match[1]}.{match[2]}") if match[2] else ""
        return deeper or _key_address(match[1])


@cache
def _key_address(path: str) -> str:
    """Return the address of a key of the robot file.

    If many sections have the key, return the address of their list.
    """
    name = path.rpartition(".")[2]
    sections = sections_with_key(path)
    if not sections:
        return ""
    anchor = key_anchor(sections[0], name) if len(sections) == 1 else key_anchor("key", name)
    return f"{keys_path('robot')}#{anchor}"
