"""``crescentlab linearize``: the linear model at an operating point, its modes, responses and impedances."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab.analysis.linear.files import UNITS, check_linear_target, document, write
from crescentlab.analysis.linear.frequency import POINTS, Responses, Transfer, band, frequency_response
from crescentlab.analysis.linear.modes import Mode
from crescentlab.analysis.linear.plots import shown_gain, write_frequency_plots
from crescentlab.analysis.steady.rest import Site
from crescentlab.circuit import Circuit, load, snapshot_of
from crescentlab.cli import DONE
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import counted, settings, table
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, MovingError, UnitError
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.units import QUANTITIES

MOST_MODES = 24
"""Most modes that the summary lists."""
TAKES_PART = 0.05
"""Smallest share of a state that the summary lists, and the most states of a mode."""
MOST_STATES = 4


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument(
        "--at", metavar="T", help="simulate to this time and linearise there, '0 s': at the start; default: at rest"
    )
    parser.add_argument("--start", metavar="FILE", help="linearise at the end of this result; with --at go on from it")
    parser.add_argument(
        "--input", action="append", default=[], metavar="NAME", help="a parameter, or a net: flow or force into it"
    )
    parser.add_argument("--output", action="append", default=[], metavar="VAR", help="a variable, such as line.p")
    parser.add_argument(
        "--impedance", action="append", default=[], metavar="PORT_OR_NET", help="pressure over flow, of a net or a port"
    )
    parser.add_argument(
        "--frequencies", default="1 Hz:2 kHz", metavar="LOW:HIGH", help="in Hz or rad/s, by default '1 Hz:2 kHz'"
    )
    parser.add_argument("--points", type=int, default=POINTS, metavar="N", help=f"frequencies; default {POINTS}")
    parser.add_argument(
        "--unit", default="Hz", choices=list(UNITS), help="of frequencies in tables, files and pictures"
    )
    parser.add_argument("--exact-lines", action="store_true", help="overlay: lines by their exact two-ports")
    parser.add_argument(
        "-o", metavar="FILE", dest="file", help=".csv (and its companions) or .json; none writes nothing"
    )
    parser.add_argument("--plot", action="store_true", help="write Bode diagram, impedance and poles as PNG files")
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    low, high = band(options.frequencies)
    if options.file == "none":
        options.file = None
    if options.file is not None:
        check_linear_target(Path(options.file))
    if bool(options.input) != bool(options.output):
        given, missing = ("--input", "--output") if options.input else ("--output", "--input")
        raise InputError(f"{given} without {missing}: a response has both; name the other, for example {missing} "
                         f"{'line.p' if missing == '--output' else 'pump.flow'}")  # fmt: skip
    if options.exact_lines and not (options.input or options.impedance):
        raise InputError("--exact-lines without a response: name --input and --output, or --impedance")
    values = settings(options.set)
    circuit = load(options.circuit, no_code=options.no_code)
    point, origin = operating_point(circuit, values, options)
    found = frequency_response(
        circuit, values, at=point, inputs=options.input, outputs=options.output, impedances=options.impedance,
        omega=(low, high), points=options.points, exact=options.exact_lines,
    )  # fmt: skip
    design = found.model.design
    title = design.netlist.sections.title or design.netlist.name
    made = document(found, title, options.unit) if options.json or options.file else {}
    files = write(found, made, Path(options.file), options.unit) if options.file else []
    if options.plot:
        base = Path(options.file).with_suffix("") if options.file else Path(f"{circuit.netlist.name}_linear")
        files += write_frequency_plots(found, title, base, options.unit)
    if options.json:
        made |= {"status": "done", "operating_point": made["operating_point"] | {"found_by": origin},
                 "warnings": list(found.warnings), "files": [str(f) for f in files], "error": None}  # fmt: skip
        print(json.dumps(made, indent=1, allow_nan=False))
    elif not options.quiet:
        print(summary(found, title, origin, options.unit, files))
    return DONE


def operating_point(circuit: Circuit, values: dict[str, str], options: argparse.Namespace) -> tuple[Snapshot, str]:
    """Where to linearise, and how that was found."""
    if options.at is not None:
        return simulated_to(circuit, values, options.at, options.start)
    if options.start is not None:
        return snapshot_of(options.start, circuit.system(values)), f"the end of {options.start}"
    from crescentlab.analysis.steady import steady

    try:
        found = steady(circuit, values)
    except MovingError as error:
        still = "let the time stand still with crescentlab steady --at T"
        advice = f"{still} and linearise the file that it writes (--start FILE), or linearise a run at a time (--at T)"
        raise MovingError(error.why, advice) from None
    return found.snapshot, f"steady, by {found.method}"


def simulated_to(circuit: Circuit, values: dict[str, str], at: str, start: str | None) -> tuple[Snapshot, str]:
    """Where a run stands at a time, which at its begin is its start."""
    try:
        t = QUANTITIES["time"].parse(at)
    except UnitError:
        raise InputError(f"--at {at}: a time is a number with its unit; write for example 20 ms") from None
    begin = started(circuit, values, start)
    if t < begin.t:
        raise InputError(f"--at {at} is before the start, {begin.t:g} s; write this time or a later one")
    if t == begin.t:
        return begin, "the start values, at 0 s" if start is None else f"the end of {start}"
    result = circuit.simulate(t, values, start=start)
    if result.trajectory.end is None:
        raise InputError(f"--at {at}: the run has no end to linearise at")
    return result.trajectory.end, f"simulated to {QUANTITIES['time'].show(result.trajectory.end.t, 'ms')}"


def started(circuit: Circuit, values: dict[str, str], start: str | None) -> Snapshot:
    """The end of a result, or the circuit's start values with what fires there."""
    design = circuit.design(values)
    system = circuit.assembled(design)
    if start is not None:
        return snapshot_of(start, system)
    numbers = system.values(design)
    site = Site(system, numbers, numbers.start_time, design.netlist.sections.simulation.stop)
    return site.snapshot(site.begun(None))


# -- what is printed -----------------------------------------------------------------------------


def summary(found: Responses, title: str, origin: str, unit: str, files: list[Path]) -> str:
    """The linear model in a few lines."""
    parts = [title, table(_facts(found, origin), indent="  ")]
    if found.modes:
        more = len(found.modes) - MOST_MODES
        rows = [_mode_titles(unit), *(_mode(m, unit) for m in found.modes[:MOST_MODES])]
        said = f"\n  and {counted(more, 'faster mode')}" if more > 0 else ""
        parts.append(table(rows, right=(0, 1, 2), indent="  ") + said)
    if found.transfers:
        low = f"at {_frequency(float(found.omega[0]), unit)}"
        titles = ("", "unit", low, "largest", "at")
        rows_ = [row for t in found.transfers for row in _transfer(t, found, found.model.design, unit)]
        parts.append(table([titles, *rows_], right=(2, 3, 4), indent="  "))
    parts += [f"  warning: {text}" for text in found.warnings]
    if files:
        parts.append("\n".join(f"  wrote {path}" for path in files))
    return "\n\n".join(parts)


def _facts(found: Responses, origin: str) -> list[tuple[str, str]]:
    m = found.model
    model = f"{counted(len(m.states), 'state')}, {counted(len(m.inputs), 'input')}, {counted(len(m.outputs), 'output')}"
    rows = [("point", f"{origin}; residual {m.residual:.2g}"), ("model", model)]
    if m.period is not None:
        rows.append(("ticks", f"every {QUANTITIES['time'].show(m.period, 'us')}; A maps from one to the next"))
    growing = sum(not mode.stable for mode in found.modes if mode.eigenvalue)
    rows.append(("modes", f"{len(found.modes)}, {'all stable' if not growing else f'{growing} of them grow'}"))
    for line in found.lines:
        pressure, flow = QUANTITIES["pressure"].show(line.p_mean, "bar"), QUANTITIES["flow"].show(line.q_mean, "L/min")
        rows.append(("exact line", f"{line.name}, at {pressure} and {flow}"))
    return rows


def _mode_titles(unit: str) -> tuple[str, ...]:
    return f"frequency [{unit}]", "damping", "time constant", "takes part"


def _mode(mode: Mode, unit: str) -> tuple[str, ...]:
    shares = [(n, s) for n, s in mode.parts.items() if s >= TAKES_PART][:MOST_STATES]
    states = ", ".join(f"{name} {share:.0%}" for name, share in shares)
    constant = QUANTITIES["time"].show(mode.time_constant, "ms", 4) if math.isfinite(mode.time_constant) else "none"
    damping = f"{mode.damping_ratio:.4g}" if mode.eigenvalue else "none"
    swing = f"{mode.damped_frequency / UNITS[unit]:.5g}" if mode.damped_frequency else "0"
    return swing, damping, constant, states


def _transfer(t: Transfer, found: Responses, design: Design, unit: str) -> list[tuple[str, ...]]:
    factor, gain = shown_gain(design, t)
    rows: list[tuple[str, ...]] = []
    for name, values in ((t.name, t.value), (f"{t.name}, exact lines", t.exact)):
        if values is not None:
            size = np.abs(values) * factor
            k = int(size.argmax())
            peak: Any = _frequency(float(found.omega[k]), unit)
            rows.append((name, "" if gain == "1" else gain, f"{size[0]:.5g}", f"{size[k]:.5g}", peak))
    return rows


def _frequency(omega: float, unit: str) -> str:
    return f"{omega / UNITS[unit]:.5g} {unit}"
