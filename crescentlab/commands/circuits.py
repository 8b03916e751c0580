"""``crescentlab circuits``: the circuits that come with crescentlab, and copying one with its files."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from crescentlab.circuit import shipped
from crescentlab.errors import InputError, nearest
from crescentlab.netlist import Netlist
from crescentlab.yaml_text import Node

FILES = (".yaml", ".yml", ".csv", ".py")
"""Suffixes of texts in a circuit that name another file."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="a shipped circuit")
    parser.add_argument("--copy", metavar="DIR", help="copy the circuit, its parts and tables to DIR")


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    known = shipped()
    if options.name is None:
        if options.copy:
            raise InputError(f"--copy {options.copy}: name the circuit to copy: {', '.join(known)}")
        print("\n".join(f"{name}  {Netlist.read(path).sections.title}" for name, path in known.items()))
        return 0
    if options.name not in known:
        raise InputError(f"{options.name}: no circuit of this name: {nearest(options.name, known)}")
    files = referred(known[options.name])
    if options.copy:
        print("\n".join(str(path) for path in copied(files, known[options.name].parent, Path(options.copy))))
    else:
        print("\n".join(str(path) for path in files))
    return 0


def referred(path: Path) -> list[Path]:
    """The circuit file, then every part and table it refers to, and they in turn."""
    found: dict[Path, None] = {path: None}
    waiting = [path]
    while waiting:
        here = waiting.pop()
        if here.suffix not in (".yaml", ".yml"):
            continue
        for text in _texts(Netlist.read(here).node):
            other = here.parent / text
            if text.endswith(FILES) and other.is_file() and other not in found:
                found[other] = None
                waiting.append(other)
    return list(found)


def _texts(node: Node) -> list[str]:
    """Every scalar under a node."""
    if isinstance(node.value, str):
        return [node.value]
    children = node.value.values() if isinstance(node.value, dict) else node.value
    return [text for child in children for text in _texts(child)]


def copied(files: list[Path], base: Path, folder: Path) -> list[Path]:
    """Copy files to a folder, made if need be; a different file that is already there is not replaced."""
    targets = {file: folder / file.resolve().relative_to(base.resolve()) for file in files}
    for file, target in targets.items():
        if target.exists() and target.read_bytes() != file.read_bytes():
            raise InputError(f"{target} exists and differs; remove it or choose another folder")
    try:
        for file, target in targets.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, target)
    except OSError as error:
        raise InputError(f"--copy {folder}: cannot be written ({error.strerror})") from None
    return list(targets.values())
