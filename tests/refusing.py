"""A small circuit and its mistakes: text with one edit, run through the command line, must be refused at a line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from crescentlab.cli import main

CIRCUIT = """\
crescentlab: 1
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
parameters:
  supply: 30 L/min
components:
  pump: {type: flow_source, flow: = supply}
  line: {type: capacity, volume: 70 cm^3, start: {p: 1 bar}}
  hole: {type: orifice, area: 5 mm^2}
  tank: {type: tank}
nets:
  p_line: [pump.port, line.port, hole.a]
  t_line: [hole.b, tank.port]
simulation: {stop: 10 ms}
"""
"""Accepted as it stands; the mistakes are edits of it."""

PUMP = "{type: flow_source, flow: = supply}"
HOLE, TANK = "  hole: {type: orifice, area: 5 mm^2}", "  tank: {type: tank}"
P_LINE, T_LINE = "  p_line: [pump.port, line.port, hole.a]", "  t_line: [hole.b, tank.port]"
OIL = "fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"
SUPPLY, STOP = "  supply: 30 L/min", "simulation: {stop: 10 ms}"
"""Lines of it."""

MARK = " <--"
"""Marks the line that a message must name; taken out before the text is used."""


def edited(*edits: tuple[str, str], text: str = CIRCUIT) -> str:
    """The text with each first of a pair replaced by its second, which must be found."""
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def added(section: str) -> str:
    """The circuit with a section at its end."""
    return f"{CIRCUIT}{section}\n"


def with_parts(*components: str, nets: tuple[str, ...] = ()) -> str:
    """The circuit with more components and nets."""
    more = "".join(f"\n  {line}" for line in components)
    return edited((TANK, TANK + more), (T_LINE, T_LINE + "".join(f"\n  {line}" for line in nets)))


class Refusal:
    """Runs the command line in a folder of its own."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self.capsys = folder, capsys

    def write(self, files: Mapping[str, str]) -> None:
        """Write files, marks left out."""
        for name, text in files.items():
            (self.folder / name).write_text(text.replace(MARK, ""), encoding="utf-8")

    def run(self, *arguments: str) -> tuple[int, str, str]:
        """Exit code, stdout, stderr of a command."""
        self.capsys.readouterr()
        code = main(list(arguments))
        return code, *self.capsys.readouterr()

    def told(self, *arguments: str) -> str:
        """The one line on stderr of a command that must be refused with exit code 2."""
        code, out, err = self.run(*arguments)
        assert (code, out) == (2, ""), err
        assert err.count("\n") == 1, err
        return err.strip()

    def __call__(self, text: str, *arguments: str, command: str = "check", **files: str) -> str:
        """What is told of a circuit after ``FILE:LINE: ``, the line being the marked one of any of the files."""
        named = {"c.yaml": text, **{name.replace("__", "."): content for name, content in files.items()}}
        self.write(named)
        marked = [
            f"{name}:{number}: "
            for name, content in named.items()
            for number, line in enumerate(content.split("\n"), start=1)
            if MARK in line
        ]
        assert len(marked) == 1, "one line must be marked"
        said = self.told(command, "c.yaml", *arguments)
        assert said.startswith(marked[0])
        return said.removeprefix(marked[0])
