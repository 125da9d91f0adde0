"""The package as a drawing: its parts, and which imports which, read from the syntax trees.

``python -m tests.support.house --write`` puts the drawing into CONTRIBUTING.md; without
``--write`` it is printed.
"""

from __future__ import annotations

import argparse
import ast
import functools
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "tfcompose"
GUIDE = ROOT / "CONTRIBUTING.md"
#: The drawing stands between these lines of the guide.
BEGIN, END = "```mermaid\n", "```\n"


@functools.cache
def tree_of(file: Path) -> ast.Module:
    """Return the syntax tree of a file of the repository, which nobody changes meanwhile."""
    return ast.parse(file.read_text("utf-8"))


@functools.cache
def nodes_of(file: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the syntax tree of a file."""
    return tuple(ast.walk(tree_of(file)))


def part_of(file: Path) -> str:
    """Return the wing that a file of the package belongs to, or its name on the top floor."""
    return file.relative_to(PACKAGE).with_suffix("").parts[0]


def room_of(file: Path) -> str:
    """Return the file's dotted name below the package: ``spec.load.nodes``.

    A package's own is that of its folder.
    """
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def imports_of(file: Path, *, for_types: bool = True) -> frozenset[str]:
    """Return the modules that a file imports, anywhere in it.

    Without ``for_types`` only those loaded at run time.
    """
    names: set[str] = set()
    for_checkers = {
        inner
        for node in tree_of(file).body
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
    }
    for node in nodes_of(file):
        if node in for_checkers and not for_types:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            if node.module == "tfcompose":
                names |= {
                    f"tfcompose.{alias.name}"
                    for alias in node.names
                    if alias.name != "__version__"
                }
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            names |= {str(word.value) for word in node.args[:1] if isinstance(word, ast.Constant)}
    return frozenset(names)


def imports() -> dict[str, set[str]]:
    """Return, for each wing, the other wings that it imports."""
    graph: dict[str, set[str]] = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        part = part_of(file)
        if part in {"__init__", "__main__"}:
            continue
        imported = {
            name.split(".")[1] for name in imports_of(file) if name.startswith("tfcompose.")
        }
        graph.setdefault(part, set()).update(imported - {part})
    return graph


def reachable(graph: dict[str, set[str]], part: str) -> set[str]:
    """Return what a part imports, directly or through others."""
    visited: set[str] = set()
    waiting = list(graph[part])
    while waiting:
        imported = waiting.pop()
        if imported not in visited:
            visited.add(imported)
            waiting.extend(graph[imported])
    return visited


def reduced(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return the graph without the imports that follow from others.

    What is left says the same order.
    """
    below = {part: reachable(graph, part) for part in graph}
    return {
        part: {target for target in imported if not any(target in below[via] for via in imported)}
        for part, imported in graph.items()
    }


def mermaid() -> str:
    """Return the drawing, as lines of Mermaid: an arrow leads from a part to what it imports."""
    lines = ["flowchart TD"]
    for wing, imported in sorted(reduced(imports()).items()):
        lines += [f"  {wing} --> {target}" for target in sorted(imported)] or [f"  {wing}"]
    return "".join(f"{line}\n" for line in lines)


def with_drawing(text: str) -> str:
    """Return the guide's text with the drawing as it is now."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    return f"{before}{begin}{mermaid()}{end}{after}"


def main(words: list[str]) -> None:
    """Print the drawing, or write it into the guide."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.house", description=__doc__)
    parser.add_argument(
        "--write", action="store_true", help="put the drawing into CONTRIBUTING.md"
    )
    if parser.parse_args(words).write:
        GUIDE.write_text(with_drawing(GUIDE.read_text("utf-8")), encoding="utf-8")
    else:
        sys.stdout.write(mermaid())


if __name__ == "__main__":
    main(sys.argv[1:])
