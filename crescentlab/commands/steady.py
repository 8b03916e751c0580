"""``crescentlab steady``: the operating point, and a result that other commands can start from."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from crescentlab.analysis.steady import OperatingPoint, steady
from crescentlab.circuit import load
from crescentlab.cli import DONE, FAILED
from crescentlab.commands import arguments as shared
from crescentlab.commands.simulate import MAX_NETS, finite, progress_bar
from crescentlab.commands.text import counted, settings, table
from crescentlab.errors import SimulationError
from crescentlab.series_files import result_target
from crescentlab.units import QUANTITIES

KEYS = (
    "status", "method", "iterations", "steps", "residual", "time", "time_constant", "unknowns", "resting", "values",
    "wall_s", "warnings", "file", "error",
)  # fmt: skip
"""Keys of the object that ``--json`` prints."""
MAX_NAMES = 6
"""Most names listed in a line of the summary."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument("--start", metavar="FILE", help="look near the end of this result")
    parser.add_argument("--at", metavar="T", help="let the time stand still here; default: at the start")
    parser.add_argument(
        "--tolerance", metavar="R", type=shared.number, default=1e-9, help="relative error of every unknown (1e-9)"
    )
    shared.result_file(parser)
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    values = settings(options.set)
    circuit = load(options.circuit, no_code=options.no_code)
    target = result_target(options.output, f"{circuit.netlist.name}_steady")
    try:
        with progress_bar(options.quiet) as progress:
            point = steady(
                circuit, values, start=options.start, at=options.at, tolerance=options.tolerance, progress=progress
            )
    except SimulationError as error:
        if options.json:
            failed = {"status": "failed", "values": {}, "resting": [], "warnings": [], "error": str(error)}
            print(json.dumps({**dict.fromkeys(KEYS), **failed}, indent=2))
        print(error, file=sys.stderr)
        return FAILED
    if target is not None:
        point.result.write(target)
    if options.json:
        print(json.dumps(finite(report(point, target)), indent=2))
    elif not options.quiet:
        print(summary(point, target))
    return DONE


def report(point: OperatingPoint, target: Path | None) -> dict[str, Any]:
    """The object of ``--json``; values in SI."""
    result = point.result
    return {
        "status": "done", "method": point.method, "iterations": point.iterations, "steps": point.steps,
        "residual": point.residual, "time": point.snapshot.t, "time_constant": point.time_constant,
        "unknowns": point.unknowns, "resting": list(point.resting),
        "values": {n: {"value": float(result[n][0]), "unit": result.quantity(n).si} for n in _shown(point)},
        "wall_s": point.wall_s, "warnings": list(point.warnings), "file": str(target) if target else None,
        "error": None,
    }  # fmt: skip


def summary(point: OperatingPoint, target: Path | None) -> str:
    """The operating point in a few lines, quantities in display units."""
    result = point.result
    parts = [result.title, table(_facts(point), indent="  ")]
    if rows := [_row(point, name) for name in _shown(point, MAX_NETS)]:
        more = len(result.net_pressures()) - MAX_NETS
        said = f"\n  and {counted(more, 'net')} more" if more > 0 else ""
        parts.append(table(rows, right=(2,), indent="  ") + said)
    parts += [f"  warning: {warning}" for warning in point.warnings]
    if target is not None:
        parts.append(
            f"  wrote {target}" + ("" if target.suffix == ".csv" else f": start from it with --start {target}")
        )
    return "\n\n".join(parts)


def _facts(point: OperatingPoint) -> list[tuple[str, str]]:
    time = QUANTITIES["time"]
    unit = point.result.display_unit(time)
    work = counted(point.iterations, "iteration")
    if point.steps:
        work += f" after {counted(point.steps, 'step')} of {'pseudo-' if point.method == 'continuation' else ''}time"
    rows = [
        ("method", f"{point.method}: {work} in {point.wall_s:.3g} s"),
        ("residual", f"{point.residual:.1e} of each unknown's size is the largest correction left"),
        ("model", counted(point.unknowns, "unknown")),
    ]
    if point.snapshot.t:
        rows.append(("time", f"stands still at {time.show(point.snapshot.t, unit)}"))
    if point.time_constant is not None:
        rows.append(
            ("slowest", f"a disturbance dies away within {time.show(point.time_constant, unit)} (time constant)")
        )
    if point.resting:
        more = len(point.resting) - MAX_NAMES
        names = ", ".join(point.resting[:MAX_NAMES]) + (f" and {more} more" if more > 0 else "")
        rows.append(("at rest", f"{names}, held fast in the present mode"))
    return rows


def _shown(point: OperatingPoint, nets: int | None = None) -> list[str]:
    """Outputs and net pressures."""
    result = point.result
    names = [o.name for o in result.design.outputs if o.scope == ""] + result.net_pressures()[:nets]
    return [n for name in names for n in result.elements(name)]


def _row(point: OperatingPoint, name: str) -> tuple[str, str, str]:
    quantity = point.result.quantity(name)
    unit = point.result.display_unit(quantity)
    value = quantity.show(float(point.result[name][0]) + 0.0, unit).partition(" ")[0]
    return name, "" if unit == "1" else unit, value
