"""Parameter files of ROS: parameters by node, with each value as its original text.

rcl has its own rules for values (``on`` is true, 012 is ten), so values are kept as text.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.spec.load.nodes import DEEPEST, parse_events
from tfcompose.spec.load.source import MOST_VALUES, refuse_unreadable

if TYPE_CHECKING:
    from collections.abc import Iterator

PARAMETERS = "ros__parameters"


@dataclass(frozen=True, slots=True)
class Word:
    """A scalar of the file with its span."""

    text: str
    #: Whether it has no quotes.
    plain: bool
    span: Span


@dataclass(frozen=True, slots=True)
class NodeParams:
    """Parameters in a file for the nodes that match a name."""

    #: A name, or a pattern with * for a part of a name and ** for any number of parts.
    name: str
    span: Span
    params: dict[str, Any]


@dataclass(slots=True)
class ParamsFile:
    """A parameter file: its nodes in order, and findings about the file."""

    nodes: list[NodeParams] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def load_params(text: str, file: str) -> ParamsFile:
    """Return the parameters in the file, by node.

    Raises:
        RejectedError: if it is not YAML, not a mapping, or too large.
    """
    refuse_unreadable(text, file)
    try:
        _refuse_deep(text, file)
        root = yaml.compose(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        span = (
            Span(file, mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)
            if mark
            else Span(file)
        )
        raise RejectedError([finding("TF002", error.problem or "not YAML", span)]) from None
    except (yaml.YAMLError, UnicodeEncodeError) as error:
        raise RejectedError(
            [finding("TF002", f"not YAML: {type(error).__name__}", Span(file))]
        ) from None
    if not isinstance(root, yaml.MappingNode):
        advice = "/NODE: {ros__parameters: {…}}"
        raise RejectedError(
            [finding("TF002", "a parameter file is a mapping of nodes", Span(file), help=advice)]
        )
    reader = _ParamsReader(file)
    reader.nodes(root, "")
    return reader.result


def _refuse_deep(text: str, file: str) -> None:
    """Reject a text that is nested too deep, because PyYAML's composer recurses in C.

    Raises:
        RejectedError: if it is nested too deep.
        yaml.YAMLError: if it is not YAML.
    """
    depth = 0
    for event in parse_events(text):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > DEEPEST:
                mark: Any = event.start_mark
                span = Span(file, mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)
                raise RejectedError(
                    [finding("TF008", f"nested deeper than {DEEPEST} levels", span)]
                )
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


class _ParamsReader:
    def __init__(self, file: str) -> None:
        self.file = file
        self.result = ParamsFile()
        self.count = 0
        self._open: set[int] = set()  # nodes being read: an alias of one of these would never end

    def nodes(self, mapping: yaml.MappingNode, above: str) -> None:
        """Read the nodes of a mapping.

        A mapping without parameters contains the nodes of a namespace.
        """
        with self._reading(mapping):
            self._nodes(mapping, above)

    def _nodes(self, mapping: yaml.MappingNode, above: str) -> None:
        for key, value in mapping.value:
            self._bound_depth(key)
            if not isinstance(key, yaml.ScalarNode) or not isinstance(value, yaml.MappingNode):
                span, advice = _span(self.file, key), f"/NODE: {{{PARAMETERS}: {{…}}}}"
                self.result.findings.append(
                    finding("TF018", "this is not a node with parameters", span, help=advice)
                )
                continue
            name = f"{above}/{key.value}" if above else key.value
            inner = next((item for key, item in value.value if key.value == PARAMETERS), None)
            if inner is None:
                self.nodes(value, name)
            elif isinstance(inner, yaml.MappingNode):
                self.result.nodes.append(
                    NodeParams(name, _span(self.file, key), self._mapping(inner))
                )

    def _mapping(self, node: yaml.MappingNode) -> dict[str, Any]:
        return {str(key.value): self._value(value) for key, value in node.value}

    def _value(self, node: yaml.Node) -> Any:
        self._bound_depth(node)
        with self._reading(node):
            if isinstance(node, yaml.MappingNode):
                return self._mapping(node)
            if isinstance(node, yaml.SequenceNode):
                return [self._value(item) for item in node.value]
        return Word(node.value, not getattr(node, "style", None), _span(self.file, node))

    @contextmanager
    def _reading(self, node: yaml.Node) -> Iterator[None]:
        if id(node) in self._open:
            span = _span(self.file, node)
            raise RejectedError([finding("TF008", "an alias stands inside what it names", span)])
        self._open.add(id(node))
        yield
        self._open.discard(id(node))

    def _bound_depth(self, node: yaml.Node) -> None:
        self.count += 1
        if self.count > MOST_VALUES:
            span = _span(self.file, node)
            raise RejectedError(
                [
                    finding(
                        "TF008",
                        f"more than {MOST_VALUES:,} values once aliases are followed",
                        span,
                    )
                ]
            )


def _span(file: str, node: yaml.Node) -> Span:
    begin, end = node.start_mark, node.end_mark
    return Span(file, begin.line + 1, begin.column + 1, end.line + 1, end.column + 1)
