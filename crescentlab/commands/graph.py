"""``crescentlab graph``: draw a circuit's schematic."""

from __future__ import annotations

import argparse
from pathlib import Path

from crescentlab import schematic
from crescentlab.circuit import load
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import settings
from crescentlab.graph import build


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument("-o", "--output", metavar="F.svg", required=True, help="picture: .svg, .png or .pdf")


def run(options: argparse.Namespace) -> int:
    """Run the command; drawing needs no causality, so a circuit that has none yet is drawn as well."""
    path = Path(options.output)
    schematic.check_target(path)
    circuit = load(options.circuit, no_code=options.no_code)
    schematic.draw(build(circuit.design(settings(options.set))), path)
    print(path)
    return 0
