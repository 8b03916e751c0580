"""What a row rests on: hashes of the circuit's files and of the component classes it uses, and versions."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

from crescentlab import __version__
from crescentlab.elaborate import Design
from crescentlab.yaml_text import Node, read

KERNEL = "crescentlab"
COMPONENTS = "crescentlab.components"
COMPUTING = ("*.py", "c/*", "solvers/*.py", "solvers/c/*", "analysis/**/*.py")
"""Sources of the kernel that compute rows."""
USER = "crescentlab_user_"
"""Begins the names of modules made of a circuit's own files, which are hashed with the circuit."""
COUNTING = ("casadi", "numpy", "scipy")
"""Packages whose version may move a digit."""
FILES = (".yaml", ".yml", ".csv", ".py")
"""Suffixes of the files that a circuit may name."""


def digest(path: Path) -> str:
    """Hash of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:32]


def circuit_files(circuit: Path) -> dict[str, str]:
    """Hashes of the circuit's file and of every file it names, directly or through its parts."""
    found: dict[Path, None] = {}
    todo = [circuit.resolve()]
    while todo:
        path = todo.pop()
        if path in found:
            continue
        found[path] = None
        if path.suffix in (".yaml", ".yml"):
            todo += _named(_texts(read(path)), path.parent)
    return {_shown(path, circuit.resolve().parent): digest(path) for path in sorted(found)}


def _named(texts: Iterable[str], folder: Path) -> list[Path]:
    """Existing files among texts."""
    beside = [folder / text for text in texts if text.endswith(FILES)]
    return [path.resolve() for path in beside if path.is_file()]


def _shown(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.name


def _texts(node: Node) -> Iterator[str]:
    if isinstance(node.value, str):
        yield node.value
    else:
        for child in node.value.values() if isinstance(node.value, dict) else node.value:
            yield from _texts(child)


def library_files(design: Design) -> dict[str, str]:
    """Hashes of the installed modules that define the circuit's components and fluids, and of those they import."""
    parts = [i.component for i in design.instances.values()] + list(design.fluids.values())
    modules = {cls.__module__ for part in parts for cls in type(part).__mro__}
    found: dict[str, str] = {}
    for module in sorted(modules):
        if module.partition(".")[0] not in ("builtins", "pydantic", "abc", "typing") and not module.startswith(USER):
            for name, path in _closure(module):
                found[name] = digest(path)
    return dict(sorted(found.items()))


@cache
def _closure(module: str) -> tuple[tuple[str, Path], ...]:
    """A module outside the kernel and the siblings it imports, with their files."""
    found: dict[str, Path] = {}
    todo = [module]
    while todo:
        name = todo.pop()
        if name in found or (name.partition(".")[0] == KERNEL and not name.startswith(f"{COMPONENTS}.")):
            continue
        path = _file(name)
        if path is None:
            continue
        found[name] = path
        package = name.rpartition(".")[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and package:
                base = package if node.level == 1 else ""
                full = ".".join(part for part in (base, node.module) if part)
                if full.startswith(package):
                    todo += (
                        [full, *[f"{full}.{alias.name}" for alias in node.names]]
                        if full != package
                        else [f"{full}.{alias.name}" for alias in node.names]
                    )
    return tuple(found.items())


def _file(module: str) -> Path | None:
    """The source of an importable module; None for what is none, and for a circuit's own file, hashed with it."""
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    return Path(spec.origin) if spec is not None and spec.origin and spec.origin.endswith(".py") else None


def kernel() -> str:
    """Hash of crescentlab's own sources that compute: between two versions they may change too."""
    folder = Path(str(resources.files(KERNEL)))
    paths = [p for pattern in COMPUTING for p in sorted(folder.glob(pattern))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of what computes."""
    python = {"crescentlab": __version__, "python": platform.python_version(), "machine": platform.machine()}
    return {**python, **{name: version(name) for name in COUNTING}}


@dataclass(frozen=True)
class Source:
    """What a circuit is made of: hashes of its files and of installed modules, versions."""

    circuit: dict[str, str]
    library: dict[str, str]
    versions: dict[str, str]

    @staticmethod
    def of(path: Path, design: Design) -> Source:
        """The source of a circuit as it is here and now."""
        return Source(circuit_files(path), library_files(design), versions())

    def change(self, path: Path) -> str:
        """What differs here and now, in words; empty if nothing does."""
        now = {name: digest(file) for name in self.library if (file := _file(name)) is not None}
        return changes(
            {"circuit": self.circuit, "library": self.library, "versions": self.versions},
            {"circuit": circuit_files(path), "library": now, "versions": versions()},
        )


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """What differs between two sets of conditions, in words; empty if nothing does."""
    said = []
    for part in dict.fromkeys([*before, *after]):
        one, other = before.get(part) or {}, after.get(part) or {}
        names = [name for name in dict.fromkeys([*one, *other]) if one.get(name) != other.get(name)]
        if names and part == "versions":
            said.append(", ".join(f"{name} {one.get(name)} became {other.get(name)}" for name in names))
        elif names:
            said.append(f"{part}: {', '.join(names)}")
    return "; ".join(said)


def tables(circuit: Path, texts: Iterable[str]) -> dict[str, str]:
    """Hashes of files that settings name, such as other tables."""
    folder = circuit.resolve().parent
    return {_shown(path, folder): digest(path) for path in _named(texts, folder)}
