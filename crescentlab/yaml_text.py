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
MAX_ALIASED = 100_000
"""Most values that aliases may stand for, so that a short file stays short."""
MAX_DEPTH = 40
CIRCUIT_BEGINS = "a circuit begins with crescentlab: 1"

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
            if (isinstance(node.value, dict) and step in node.value) or (
                isinstance(node.value, list) and isinstance(step, int) and step < len(node.value)
            ):
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


def read(path: Path, shown: str | None = None, begins: str = CIRCUIT_BEGINS) -> Node:
    """Read the file; raise :class:`InputError` with file and line for anything that is not YAML.

    ``begins`` tells of an empty file what its first line is.
    """
    name = shown or str(path)
    data = b""
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"the file has {size} bytes; a circuit file may have {MAX_BYTES}, so split it into subcircuits",
                Place(name, 1),
            )
        data = path.read_bytes()
        text = data.decode("utf-8-sig")
    except IsADirectoryError:
        raise InputError("this is a folder; name a circuit file in it", Place(name, 1)) from None
    except OSError as error:
        raise InputError(f"cannot read the file: {error.strerror}", Place(name, 1)) from None
    except UnicodeDecodeError as error:
        place = Place(name, 1 + data.count(b"\n", 0, error.start))
        raise InputError(
            f"byte 0x{data[error.start]:02x} is not text in UTF-8; save the file as UTF-8", place
        ) from None
    return parse(text, name, begins)


def parse(text: str, name: str, begins: str = CIRCUIT_BEGINS) -> Node:
    """Parse YAML text; ``name`` is the file shown in messages."""
    lines = text.splitlines()
    try:
        return _Builder(name, lines, begins).build(text)
    except yaml.MarkedYAMLError as error:
        said, line = _explained(error, lines)
        raise InputError(said, Place(name, line)) from None
    except yaml.reader.ReaderError as error:  # a character YAML does not allow
        code = error.character if isinstance(error.character, int) else ord(error.character)
        place = Place(name, 1 + text.count("\n", 0, max(text.find(chr(code)), 0)))
        raise InputError(f"the character U+{code:04X} is not allowed in YAML; remove it", place) from None


# -- what is wrong, and what to write instead ----------------------------------------------------


def _explained(error: yaml.MarkedYAMLError, lines: list[str]) -> tuple[str, int]:
    """A sentence for the parser's error, and the line to look at."""
    mark, context, problem = error.problem_mark or error.context_mark, error.context_mark, error.problem or ""
    line = mark.line + 1 if mark else 1
    begun = context.line + 1 if context else line
    flow = "flow" in (error.context or "")
    shown, first = _line(lines, line), _line(lines, begun)
    if (better := quoted(shown, flow and begun < line)) != shown:
        return f"{MUST_QUOTE}: {_cut(better)}", line
    if "\t" in shown[: len(shown) - len(shown.lstrip())]:
        return "a tab at the beginning of the line; indent with spaces", line
    if flow and (line > len(lines) or (line > begun and _indent(shown) <= _indent(first))):
        return f"a bracket opened here is never closed; look at: {_cut(first)}", begun
    if flow and ("' or '" in problem or "mapping values" in problem):
        return (
            f"brackets do not match, a comma is missing, or text with a colon needs quotes; look at: {_cut(shown)}",
            line,
        )
    if "end of stream" in problem:
        return f"a quote opened here is never closed; look at: {_cut(first)}", begun
    if "expected ':'" in problem:
        if glued := re.match(r"\s*([\w.]+):(\S.*)", first):
            return f"a blank is missing after the colon; write: {glued[1]}: {_cut(glued[2])}", begun
        word = first.strip().isidentifier()
        return f"a colon is missing{'; write' if word else ' in'}: {_cut(first)}{':' * word}", begun
    if "mapping values" in problem:
        return (
            f"a colon where none can stand; quote text that holds one, and look at the indentation of: {_cut(shown)}",
            line,
        )
    if "start any token" in problem and mark and mark.column < len(shown):
        return f"text that begins with {shown[mark.column]} must be quoted; look at: {_cut(shown)}", line
    if "expected" in problem and not flow:
        return (
            f"this does not continue what stands above it; look at indentation and brackets of: {_cut(shown)}",
            line,
        )
    return f"not YAML: {problem or 'it cannot be read'}; look at: {_cut(shown)}", line


MUST_QUOTE = "text with brackets or commas inside {} or [] must be quoted; write"


def _line(lines: list[str], number: int) -> str:
    return lines[number - 1] if 0 < number <= len(lines) else ""


def _cut(line: str) -> str:
    """A line as messages show it."""
    text = line.strip()
    return text if len(text) <= 300 else f"{text[:300]} ..."


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


_FLOW = re.compile(r"(?:^|(?<=:)|(?<=-))\s+(?=[\[{])|^(?=[\[{])")
_QUOTE = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\\\]|\\\\.)*\"")


def quoted(line: str, flow: bool = False) -> str:
    """The line with references such as ``chain[1]`` and expressions with commas put in quotes.

    Only what stands inside ``{}`` or ``[]`` needs them; ``flow`` says that the line begins there.
    """
    begin = _FLOW.search(line)
    if not (flow or begin):
        return line
    at = 0 if flow or begin is None else begin.end()
    out = [line[:at]]
    while at < len(line):
        if line.startswith(" #", at - 1):
            return "".join(out) + line[at:]
        match = _QUOTE.match(line, at)
        end = match.end() if match else at + 1 if line[at] in " \t,:[]{}" else _plain_end(line, at)
        text = line[at:end].rstrip()
        if not match and end > at + 1 and set(text) & set(",[]{}"):
            text = "'" + text.replace("'", "''") + "'"
        out.append(text + line[at + len(line[at:end].rstrip()) : end])
        at = end
    return "".join(out)


def _plain_end(line: str, at: int) -> int:
    """Where the text that begins at ``at`` ends, were its brackets and their commas part of it."""
    depth = 0
    for k in range(at, len(line)):
        c = line[k]
        if c in "([":
            depth += 1
        elif c in ")]" and depth:
            depth -= 1
        elif depth == 0 and (c in ",]}" or line.startswith((": ", " #"), k)):
            return k
    return len(line) if not depth else at + 1  # an open bracket: leave it alone


class _Builder:
    """Builds the tree from parser events with an explicit stack."""

    def __init__(self, name: str, lines: list[str], begins: str) -> None:
        self.name, self.lines, self.begins = name, lines, begins
        self.anchors: dict[str, Node] = {}
        self.stack: list[tuple[Node, str | None, str | None]] = []  # node, its anchor, pending key
        self.flow = 0  # how many of the innermost nodes on the stack are written in {} or []
        self.root: Node | None = None
        self.aliased = 0
        self.here = Place(name, 0)
        """The place of the last event, shared by all of its line."""

    def build(self, text: str) -> Node:
        documents = 0
        for event in yaml.parse(text, Loader=_Loader):
            if isinstance(event, yaml.ScalarEvent):
                self.add(Node(event.value, self.place(event)), event.anchor, event)
            elif isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise InputError("the file holds two YAML documents; keep one", self.place(event))
            elif isinstance(event, yaml.AliasEvent):
                if event.anchor not in self.anchors:
                    raise InputError(
                        f"the alias *{event.anchor} refers to nothing complete before it", self.place(event)
                    )
                self.add(self.anchors[event.anchor], None, event)
            elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
                if len(self.stack) >= MAX_DEPTH:
                    raise InputError(
                        f"nested deeper than {MAX_DEPTH} levels; look for brackets left open", self.place(event)
                    )
                kind: dict[str, Node] | list[Node] = {} if isinstance(event, yaml.MappingStartEvent) else []
                self.stack.append((Node(kind, self.place(event)), event.anchor, None))
                self.flow += 1 if event.flow_style else 0
            elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
                node, anchor, _ = self.stack.pop()
                self.flow = max(self.flow - 1, 0)
                self.add(node, anchor, event)
        if self.root is None:
            raise InputError(f"the file is empty; {self.begins}", Place(self.name, 1))
        return self.root

    def continued(self, event: Any) -> bool:
        """Whether the event's line begins inside ``{}`` or ``[]`` opened further up."""
        opened = self.stack[-1][0].place if self.flow else None
        return opened is not None and opened.line < self.place(event).line

    def place(self, event: Any) -> Place:
        line = event.start_mark.line + 1
        if line != self.here.line:
            self.here = Place(self.name, line)
        return self.here

    def add(self, node: Node, anchor: str | None, event: Any) -> None:
        if isinstance(event, yaml.AliasEvent):
            self.aliased += node.size
        if self.aliased > MAX_ALIASED:
            raise InputError(
                f"aliases (*name) expand to more than {MAX_ALIASED} values; write them out", self.place(event)
            )
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
            if self.flow and node.value == "" and isinstance(event, yaml.ScalarEvent) and not event.style:
                self.no_value(parent.value, key, event)
            parent.value[key] = node
            self.stack[-1] = (parent, parent_anchor, None)
        parent.size = min(parent.size + node.size, MAX_ALIASED + 1)

    def key(self, parent: Node, node: Node, event: Any) -> str:
        plain = isinstance(event, yaml.ScalarEvent) and not event.style
        if not isinstance(node.value, str) or (plain and not node.value.isidentifier()):
            self.check_key(node, event)
        assert isinstance(node.value, str)
        if node.value in parent.keys:
            first = parent.keys[node.value]
            raise InputError(
                f"the key {node.value!r} stands twice (first in line {first.line if first else '?'}); remove one",
                node.place,
            )
        parent.keys[node.value] = node.place
        return node.value

    def check_key(self, node: Node, event: Any) -> None:
        """Refuse a key that is no text, or text in which a blank or a colon is missing."""
        line = _line(self.lines, self.place(event).line)
        if not isinstance(node.value, str):
            better = quoted(line, self.continued(event))
            raise InputError(
                f"{MUST_QUOTE}: {_cut(better)}" if better != line else f"a key must be a word; look at: {_cut(line)}",
                self.place(event),
            )
        if bracket := re.match(r"([\w.]+)\s+[\[{]", node.value):
            better = line.replace(bracket[1], f"{bracket[1]}:", 1)
            raise InputError(f"a colon is missing before the bracket; write: {_cut(better)}", node.place)
        if glued := re.match(r"([A-Za-z_][\w.]*):(\S.*)", node.value):
            raise InputError(f"a blank is missing after the colon; write: {glued[1]}: {_cut(glued[2])}", node.place)

    def no_value(self, parent: dict[str, Node], key: str, event: Any) -> None:
        """Refuse a key without a value inside ``{}``: mostly the rest of a text that holds a comma."""
        place = self.place(event)
        line = _line(self.lines, place.line)
        better = quoted(line, self.continued(event))
        if better != line:
            raise InputError(f"{MUST_QUOTE}: {_cut(better)}", place)
        before, node = next(reversed(parent.items()), ("", Node("")))
        hint = ""
        if isinstance(node.value, str) and before and not line[: event.start_mark.column].rstrip().endswith(":"):
            hint = f", or quote text that holds a comma: {before}: '{node.value}, {key}'"
            if re.fullmatch(r"\s*[+-]?\d+", node.value) and re.match(r"\d", key):
                hint = f", or decimals follow a point: {before}: {node.value}.{key}"
        raise InputError(f"{key!r} has no value; write {key}: ...{hint}", place)
