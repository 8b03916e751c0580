"""YAML text -> a tree of text that remembers its lines.

Scalars stay text: what ``1e-6``, ``off`` or ``12:15`` means is decided by the schema. The tree is
built from parser events, so depth, size and aliases are bounded while reading.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from crescentlab.errors import InputError, Place

MAX_BYTES = 8_000_000
MAX_NODES = 2_000_000
MAX_DEPTH = 40

_Loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)


@dataclass(eq=False)
class Node:
    """Text, a list of nodes or a mapping to nodes, with the place where it begins."""

    value: str | list[Node] | dict[str, Node]
    place: Place | None = None
    keys: dict[str, Place | None] = field(default_factory=dict)
    size: int = 1

    @staticmethod
    def of(plain: Any) -> Node:
        """A tree without places from plain Python data."""
        if isinstance(plain, dict):
            return Node({str(k): Node.of(v) for k, v in plain.items()})
        if isinstance(plain, (list, tuple)):
            return Node([Node.of(v) for v in plain])
        return Node("true" if plain is True else "false" if plain is False else str(plain))

    def plain(self) -> Any:
        """Nested dictionaries, lists and strings."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value

    def find(self, path: Iterator[Any] | tuple[Any, ...] | list[Any]) -> Node:
        """The node at ``path``, or the deepest one on the way to it."""
        node = self
        for step in path:
            if isinstance(node.value, dict) and step in node.value:
                node = node.value[step]
            elif isinstance(node.value, list) and isinstance(step, int) and step < len(node.value):
                node = node.value[step]
            else:
                break
        return node

    def place_of(self, *path: Any) -> Place | None:
        """Where the last element of ``path`` stands: its key if it is one."""
        parent = self.find(path[:-1])
        if path and isinstance(parent.value, dict) and path[-1] in parent.keys:
            return parent.keys[path[-1]]
        return self.find(path).place


def read(path: Path, shown: str | None = None) -> Node:
    """Read the file; raise :class:`InputError` with file and line for anything that is not YAML."""
    name = shown or str(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"the file has {size} bytes; a circuit file may have {MAX_BYTES}, so split it into subcircuits",
                Place(name, 1),
            )
        text = path.read_text(encoding="utf-8-sig")
    except IsADirectoryError:
        raise InputError("this is a folder; name a circuit file in it", Place(name, 1)) from None
    except OSError as error:
        raise InputError(f"cannot read the file: {error.strerror}", Place(name, 1)) from None
    except UnicodeDecodeError:
        raise InputError("the file is not text in UTF-8", Place(name, 1)) from None
    return parse(text, name)


def parse(text: str, name: str) -> Node:
    """Parse YAML text; ``name`` is the file shown in messages."""
    lines = text.splitlines()
    try:
        return _Builder(name, lines).build(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        raise InputError(_explain(error.problem or "cannot be read", lines, line), Place(name, line)) from None
    except yaml.YAMLError as error:  # a character YAML does not allow
        raise InputError(f"not YAML: {str(error).splitlines()[0]}", Place(name, 1)) from None


def _explain(problem: str, lines: list[str], line: int) -> str:
    shown = lines[line - 1] if 0 < line <= len(lines) else ""
    better = quoted(shown)
    if better != shown:
        return f"text with brackets or commas inside {{}} or [] must be quoted; write: {better.strip()}"
    if "\t" in shown[: len(shown) - len(shown.lstrip())]:
        return "not YAML: a tab at the beginning of the line; indent with spaces"
    return f"not YAML: {problem}; look at: {shown.strip()!r}"


_INDEXED = re.compile(r"(?<![\w.\"'\[])((?:\w+\.)+\w+\[[^\[\]]*\])(?![\"'])")
_EXPRESSION = re.compile(r"(?<=[:\[,])(\s*)(=\s*[^\"'{}]*?\((?:[^()]|\([^()]*\))*\)[^,{}\[\]\"']*?)(\s*)(?=[,}\]])")


def quoted(line: str) -> str:
    """The line with references such as ``chain[1]`` and expressions with commas put in quotes."""
    start = next((i for i, c in enumerate(line) if c in "[{"), None)
    if start is None:
        return line
    head, tail = line[:start], line[start:]
    tail = _EXPRESSION.sub(lambda m: f"{m[1]}'{m[2].strip()}'{m[3]}", tail)
    tail = tail[0] + _INDEXED.sub(r"'\1'", tail[1:])
    return head + tail


class _Builder:
    """Builds the tree from parser events with an explicit stack."""

    def __init__(self, name: str, lines: list[str]) -> None:
        self.name, self.lines = name, lines
        self.anchors: dict[str, Node] = {}
        self.stack: list[tuple[Node, str | None, str | None]] = []  # node, its anchor, pending key
        self.root: Node | None = None
        self.count = 0

    def build(self, text: str) -> Node:
        documents = 0
        for event in yaml.parse(text, Loader=_Loader):
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise InputError("the file holds two YAML documents; keep one", self.place(event))
            elif isinstance(event, yaml.ScalarEvent):
                self.add(Node(event.value, self.place(event)), event.anchor, event)
            elif isinstance(event, yaml.AliasEvent):
                if event.anchor not in self.anchors:
                    raise InputError(
                        f"the alias *{event.anchor} refers to nothing complete before it", self.place(event)
                    )
                self.add(self.anchors[event.anchor], None, event)
            elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
                if len(self.stack) >= MAX_DEPTH:
                    raise InputError(f"nested deeper than {MAX_DEPTH} levels", self.place(event))
                kind: dict[str, Node] | list[Node] = {} if isinstance(event, yaml.MappingStartEvent) else []
                self.stack.append((Node(kind, self.place(event)), event.anchor, None))
            elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
                node, anchor, _ = self.stack.pop()
                self.add(node, anchor, event)
        if self.root is None:
            raise InputError("the file is empty; a circuit begins with `crescentlab: 1`", Place(self.name, 1))
        return self.root

    def place(self, event: Any) -> Place:
        return Place(self.name, event.start_mark.line + 1)

    def add(self, node: Node, anchor: str | None, event: Any) -> None:
        self.count += node.size if isinstance(event, yaml.AliasEvent) else 1
        if self.count > MAX_NODES:
            raise InputError(f"the file expands to more than {MAX_NODES} values (aliases included)", self.place(event))
        if anchor:
            self.anchors[anchor] = node
        if not self.stack:
            self.root = node
            return
        parent, parent_anchor, key = self.stack[-1]
        if isinstance(parent.value, list):
            parent.value.append(node)
        elif key is None:
            self.stack[-1] = (parent, parent_anchor, self.key(parent, node, event))
            return
        else:
            assert isinstance(parent.value, dict)
            if (
                node.value == ""
                and isinstance(event, yaml.ScalarEvent)
                and not event.style
                and (")" in key or "]" in key)
            ):
                self.slip(event)
            parent.value[key] = node
            self.stack[-1] = (parent, parent_anchor, None)
        parent.size = min(parent.size + node.size, MAX_NODES + 1)

    def key(self, parent: Node, node: Node, event: Any) -> str:
        if not isinstance(node.value, str):
            raise InputError(_explain("a key must be a word", self.lines, self.place(event).line), self.place(event))
        if node.value in parent.keys:
            first = parent.keys[node.value]
            raise InputError(
                f"the key {node.value!r} stands twice (first in line {first.line if first else '?'}); remove one",
                node.place,
            )
        parent.keys[node.value] = node.place
        return node.value

    def slip(self, event: Any) -> None:
        place = self.place(event)
        raise InputError(_explain("a key without a value", self.lines, place.line), place)
