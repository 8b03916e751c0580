"""``crescentlab results``: what a result file holds, or its series as CSV on stdout."""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from crescentlab.commands.text import counted, table
from crescentlab.result import matching
from crescentlab.series_files import read_series


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("file", metavar="FILE", help="a result: .nc, .csv or .parquet")
    parser.add_argument("variables", metavar="VAR", nargs="*", help="variables to print as CSV; * and ? are wild")


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    time, series, units, attributes = read_series(Path(options.file))
    if options.variables:
        chosen = matching(options.variables, list(series), "variable")
        _print_csv(time, {name: series[name] for name in chosen}, units)
        return 0
    said = {key: value for key, value in attributes.items() if str(value) not in ("", "None")}
    rows = [(str(key), str(value)) for key, value in said.items()]
    span = f", {time[0]:g} s to {time[-1]:g} s" if time.size else ""
    parts = [f"{options.file}: {counted(time.size, 'row')}{span}, {counted(len(series), 'variable')}"]
    if rows:
        parts.append(table(rows, indent="  "))
    if series:
        lines = [(name, units.get(name, ""), *_range(values)) for name, values in series.items()]
        parts.append(table([("variable", "unit", "min", "max"), *lines], right=(2, 3), indent="  "))
    print("\n\n".join(parts))
    return 0


def _range(values: np.ndarray) -> tuple[str, str]:
    finite = values[np.isfinite(values)]
    return (f"{finite.min():.6g}", f"{finite.max():.6g}") if finite.size else ("", "")


def _print_csv(time: np.ndarray, series: dict[str, np.ndarray], units: dict[str, str]) -> None:
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["time [s]", *[f"{name} [{units.get(name, '')}]" for name in series]])
    for row in zip(time.tolist(), *[values.tolist() for values in series.values()], strict=True):
        writer.writerow([repr(value) for value in row])
