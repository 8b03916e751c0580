"""``crescentlab periodic``: the periodic steady state, and its last period as a result."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from crescentlab import plotting
from crescentlab.analysis.periodic import Periodic, periodic
from crescentlab.circuit import load
from crescentlab.cli import DONE, FAILED
from crescentlab.commands import arguments as shared
from crescentlab.commands.simulate import figures, finite, progress_bar
from crescentlab.commands.text import counted, settings, table
from crescentlab.result import check_record
from crescentlab.series_files import result_target
from crescentlab.units import QUANTITIES


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument("--period", metavar="T", help="time after which the circuit repeats itself; default: its own")
    parser.add_argument("--tolerance", metavar="R", type=shared.number, help="largest distance left, relative")
    parser.add_argument("--most", metavar="N", type=int, default=300, help="most periods integrated (300)")
    parser.add_argument("--plain", action="store_true", help="iterate without acceleration")
    parser.add_argument("--compare", action="store_true", help="count the periods of a plain transient as well")
    shared.start(parser)
    shared.solver(parser)
    parser.set_defaults(solver="rodas")
    shared.result_file(parser)
    parser.add_argument("--record", action="append", default=[], metavar="GLOB", help="variables to write")
    parser.add_argument("--plot", action="store_true", help="write the circuit's plots of the last period as PNG files")
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    values = settings(options.set)
    circuit = load(options.circuit, no_code=options.no_code)
    target = result_target(options.output, f"{circuit.netlist.name}_periodic")
    check_record(circuit.system(values), options.record)
    with progress_bar(options.quiet) as progress:
        found = periodic(
            circuit, values, period=options.period, tolerance=options.tolerance, most=options.most,
            solver=options.solver, rtol=options.rtol, compile=options.compile, start=options.start,
            accelerate=not options.plain, compare=options.compare, progress=progress,
        )  # fmt: skip
    if target is not None:
        found.result.write(target, options.record)
    stem = (target or Path(f"{circuit.netlist.name}_periodic")).with_suffix("")
    pictures = plotting.write_plots(found.result, stem) if options.plot else []
    if options.json:
        print(json.dumps(finite(report(found, target)), indent=2))
    elif not options.quiet:
        print(summary(found, target, pictures))
    if not found.converged:
        print(found.message, file=sys.stderr)
    return DONE if found.converged else FAILED


def report(found: Periodic, target: Path | None) -> dict[str, Any]:
    """The object of ``--json``."""
    return {
        "status": "done" if found.converged else "failed", "period": found.period, "periods": found.periods,
        "residual": found.residual, "distance": found.distance, "tolerance": found.tolerance,
        "multiplier": found.multiplier, "plain_periods": found.plain, "plain_periods_estimated": found.plain_estimate,
        "slowest": found.slowest, "means": {n: found.result.mean(n) for n in _shown(found)},
        "warnings": list(found.result.trajectory.warnings), "file": str(target) if target else None,
        "error": found.message or None,
    }  # fmt: skip


def _shown(found: Periodic) -> list[str]:
    result = found.result
    names = [o.name for o in result.design.outputs if o.scope == ""] + result.net_pressures()
    return [n for name in names for n in result.elements(name)]


def summary(found: Periodic, target: Path | None, pictures: list[Path]) -> str:
    """The periodic state in a few lines."""
    time = QUANTITIES["time"].show(found.period, found.result.display_unit(QUANTITIES["time"]), 6)
    rows = [
        ("period", f"{time}, {1 / found.period:.6g} Hz"),
        ("periods", counted(found.periods, "period") + f" integrated, {saved(found)}"),
        ("distance", f"{found.distance:.1e} of each variable's size is left ({found.tolerance:.1e} allowed)"),
    ]
    if 0 < found.multiplier < 1:
        rows.append(("slowest", f"a period leaves {found.multiplier:.2g} of a disturbance; {found.slowest[0]}"))
    parts = [found.result.title, table(rows, indent="  ")]
    if shown := figures(found.result):
        parts.append(table(shown, right=(2, 3, 4, 5), indent="  "))
    written = [f"  wrote {path}" for path in ([target] if target else []) + pictures]
    return "\n\n".join([*parts, "\n".join(written)] if written else parts)


def saved(found: Periodic) -> str:
    """How many periods a plain transient would have taken more."""
    if found.plain is not None:
        return f"{found.plain - found.periods} saved: a plain transient takes {found.plain}"
    if math.isfinite(estimate := found.plain_estimate):
        return f"a plain transient would take about {estimate:.0f}"
    return "a plain transient cannot be reckoned"
