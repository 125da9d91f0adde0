"""Calls of functions of tools. A crash of a tool becomes a finding, and other tools still run."""

from __future__ import annotations

from typing import Any

from tfcompose.foundation.findings import Finding, Span, finding
from tfcompose.foundation.tool import load


def run_hook(
    reference: str, owner: str, span: Span | None, *arguments: Any
) -> list[Any] | Finding:
    """Return what a tool's function yields, or the finding TF903 if it crashes."""
    try:
        return list(load(reference)(*arguments))
    except Exception as error:  # noqa: BLE001 (a tool's fault must not hide the others' findings)
        return finding(
            "TF903",
            f"{reference} of {owner} crashed: {type(error).__name__}: {error}",
            span,
            help="this is a bug in the tool: please report it",
        )
