"""The robot's description as it is sent: with addresses of meshes that are good wherever it is read on this machine."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import quote

_RELATIVE = re.compile(
    r"""(<(?:mesh|texture)\s[^<>]*?\bfilename\s*=\s*)(["'])(?!/|[A-Za-z][A-Za-z0-9+.-]*://)([^<>]+?)\2"""
)


def with_absolute_addresses(urdf: str, folder: Path) -> str:
    """Return the URDF in which paths that begin in ``folder``, where it was built, are absolute ``file://`` addresses.

    Who reads the description from a topic does not know that folder. Only the machine that runs the plan does, so that
    what is built stays the same everywhere.
    """

    def absolute(found: re.Match[str]) -> str:
        path = Path(folder, _unescaped(found[3])).resolve()
        return f"{found[1]}{found[2]}file://{quote(str(path))}{found[2]}"

    return _RELATIVE.sub(absolute, urdf)


def _unescaped(text: str) -> str:
    for entity, character in (("&quot;", '"'), ("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")):
        text = text.replace(entity, character)
    return text
