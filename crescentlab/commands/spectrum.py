"""``crescentlab spectrum``: amplitude spectra over whole periods, orders, waterfalls of a run-up."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from crescentlab.analysis.periodic import periodic
from crescentlab.analysis.spectrum import Series, Spectrum, spectra, spectra_of_rows
from crescentlab.analysis.spectrum.plots import plot_spectra, plot_waterfall
from crescentlab.analysis.spectrum.waterfall import HIGHEST_ORDER, REVOLUTIONS, Waterfall, waterfalls
from crescentlab.circuit import Circuit, load
from crescentlab.cli import DONE
from crescentlab.commands import arguments as shared
from crescentlab.commands.simulate import progress_bar
from crescentlab.commands.spectrum_text import (
    Shown,
    report,
    spectrum_rows,
    summary,
    waterfall_report,
    waterfall_rows,
    waterfall_text,
)
from crescentlab.commands.text import settings
from crescentlab.errors import InputError, SimulationError, UnitError, nearest
from crescentlab.files import check_writable, write_rows, write_text
from crescentlab.result import Result, column_names, matching
from crescentlab.series_files import SUFFIXES, read_series
from crescentlab.units import DISPLAY, QUANTITIES, Quantity, is_number

time, frequency, speed = QUANTITIES["time"], QUANTITIES["frequency"], QUANTITIES["speed"]
LINES = 10
STEADY = 1e-3
"""Part by which a shaft's speed may change within a window before lines smear."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("source", metavar="CIRCUIT|RESULT", help="a circuit, or a result file with an even grid")
    parser.add_argument("variables", metavar="VAR", nargs="+", help="variables; * and ? are wild")
    shared.settings(parser)
    parser.add_argument("--stop", metavar="T", help="end time, for example '200 ms'; periods end there")
    shared.start(parser)
    shared.solver(parser)
    parser.add_argument("--periodic", action="store_true", help="find the periodic steady state first")
    parser.add_argument("--period", metavar="T", help="time after which the circuit repeats itself; default: its own")
    parser.add_argument("--frequency", metavar="F", help="the same as a frequency, for example '433.3 Hz'")
    parser.add_argument("--periods", metavar="N", type=int, help="whole periods taken (1, the last one)")
    parser.add_argument("--from", dest="begin", metavar="T", help="take the whole periods after this time")
    parser.add_argument("--highest", metavar="F", help="highest frequency, for example '5 kHz' (50 harmonics)")
    parser.add_argument("--lines", metavar="N", type=int, default=LINES, help=f"strongest lines printed ({LINES})")
    parser.add_argument("--orders", metavar="SPEED", help="shaft speed: a number, a parameter, or a variable")
    parser.add_argument("--waterfall", action="store_true", help="orders over the speed of the shaft --orders VARIABLE")
    parser.add_argument("--revolutions", metavar="R", type=int, help=f"of a waterfall's window ({REVOLUTIONS})")
    parser.add_argument("--window", metavar="W", help="of a waterfall: hann, or whole for none")
    parser.add_argument(
        "--highest-order", metavar="N", type=shared.number,
        help=f"of a waterfall ({HIGHEST_ORDER:g})",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="FILE", help="all lines: .csv or .json")
    parser.add_argument("--plot", action="store_true", help="write a picture beside it")
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    _check(options)
    return _of_file(options) if Path(options.source).suffix in SUFFIXES else _of_circuit(options)


def _check(options: argparse.Namespace) -> None:
    """Find before the run what is wrong in the options."""
    if options.period and options.frequency:
        raise InputError("--period and --frequency say the same; write one of them")
    if options.output:
        check_writable(Path(options.output), (".csv", ".json"), "lines are written as .csv or .json")
    if options.periodic and (options.stop or options.begin or options.periods not in (None, 1)):
        raise InputError("--periodic gives exactly one period; leave --stop, --from and --periods out")
    if options.waterfall and (options.periodic or options.period or options.frequency or options.periods):
        raise InputError("--waterfall takes whole revolutions of the shaft; leave periods out")
    if options.waterfall and not options.orders:
        raise InputError("--waterfall needs the variable of the shaft's speed, for example --orders shaft.shaft.omega")
    for name in [] if options.waterfall else _asked(options):
        option = {"highest": "--highest-order"}.get(name, f"--{name}")
        raise InputError(f"{option} belongs to a waterfall; add --waterfall, or leave it out")
    if options.waterfall and options.highest:
        raise InputError("--highest is of a spectrum; write --highest-order for a waterfall")
    if options.lines < 1:
        raise InputError(f"--lines {options.lines}: print at least one")


def _period(options: argparse.Namespace) -> str | float | None:
    """The period that the options give, as text or in seconds."""
    if not options.frequency:
        return str(options.period) if options.period else None
    hertz = _parsed("--frequency", frequency, options.frequency)
    if not hertz > 0:
        raise InputError(f"--frequency {options.frequency} must be above 0")
    return 1 / hertz


def _parsed(option: str, quantity: Quantity, text: str) -> float:
    try:
        return quantity.parse(text)
    except UnitError as error:
        raise InputError(f"{option}: {error.message}") from None


def _highest(text: str) -> float:
    """The highest frequency [Hz]."""
    try:
        hertz = frequency.parse(text)
    except UnitError:
        raise InputError(f"--highest {text}: a frequency has a number and a unit; write for example 5 kHz") from None
    if not hertz > 0:
        raise InputError(f"--highest {text} must be above 0; write for example 5 kHz")
    return hertz


def _taken(options: argparse.Namespace) -> dict[str, Any]:
    """Which periods and lines are asked for."""
    return {
        "periods": options.periods,
        "start": _parsed("--from", time, options.begin) if options.begin else None,
        "highest": _highest(options.highest) if options.highest else None,
    }


# -- a circuit -----------------------------------------------------------------------------------


def _asked(options: argparse.Namespace) -> dict[str, Any]:
    """What is asked of a waterfall; what is not has its default."""
    given = {"revolutions": options.revolutions, "window": options.window, "highest": options.highest_order}
    return {name: value for name, value in given.items() if value is not None}


def _of_circuit(options: argparse.Namespace) -> int:
    values = settings(options.set)
    circuit = load(options.source, no_code=options.no_code)
    system = circuit.system(values)
    names = matching(options.variables, column_names(system), "variable")
    shaft = _shaft(options.orders, circuit, values)
    period = None if options.waterfall else circuit.period(circuit.design(values), _period(options))
    result, warnings = _run(circuit, values, period, options)
    units = {**DISPLAY, **circuit.netlist.sections.display}
    shown = Shown(result.title, Path(circuit.netlist.name), units, tuple(warnings))
    if options.waterfall:
        if not isinstance(shaft, str):
            raise InputError(f"--orders {options.orders}: a waterfall needs a variable, for example shaft.shaft.omega")
        begin = _parsed("--from", time, options.begin) if options.begin else None
        falls = waterfalls(
            result, names, shaft, start=begin, **_asked(options),
        )  # fmt: skip
        return _tell_waterfalls(falls, shown, options)
    assert period is not None
    found = spectra(result, [*names, *([shaft] if isinstance(shaft, str) else [])], period, **_taken(options))
    if isinstance(shaft, str):
        turning = next(each for each in found if each.name == shaft)
        found = [each for each in found if each.name in names]
        shaft = abs(turning.mean)
        shown = _steady_shaft(turning, shown)
    return _tell(found, shaft, shown, options)


def _run(
    circuit: Circuit, values: dict[str, str], period: float | None, options: argparse.Namespace
) -> tuple[Result, list[str]]:
    """The run, or one period of the periodic state; raises :class:`SimulationError` if there is none."""
    with progress_bar(options.quiet) as progress:
        if options.periodic:
            done = periodic(
                circuit, values, period=period, solver=options.solver or "rodas", rtol=options.rtol,
                compile=options.compile, start=options.start, progress=progress,
            )  # fmt: skip
            if not done.converged:
                raise SimulationError(done.message)
            return done.result, list(done.result.trajectory.warnings)
        result = circuit.simulate(
            options.stop, values, solver=options.solver, rtol=options.rtol, compile=options.compile,
            start=options.start, progress=progress,
        )  # fmt: skip
    return result, list(result.trajectory.warnings)


def _shaft(text: str | None, circuit: Circuit, values: dict[str, str]) -> float | str | None:
    """The shaft speed [rad/s], or the name of its variable."""
    if text is None:
        return None
    if is_number(text):
        return _turning(_parsed("--orders", speed, text), text)
    parameters = circuit.design(values).parameters[""]
    if text in parameters and parameters[text].quantity is speed:
        return _turning(float(parameters[text].value), text)
    variables = circuit.system(values).variables
    if text in variables and variables[text].quantity is speed:
        return text
    known = [n for n, v in variables.items() if v.quantity is speed]
    known += [n for n, p in parameters.items() if p.quantity is speed]
    raise InputError(f"--orders {text}: no shaft speed of this name: {nearest(text, known)}")


def _turning(value: float, text: str) -> float:
    if value == 0:
        raise InputError(f"--orders {text}: the shaft stands still, so nothing has an order")
    return abs(value)


def _steady_shaft(turning: Spectrum, shown: Shown) -> Shown:
    """With a warning if the speed moves within the window."""
    _turning(turning.mean, turning.name)
    moves = math.sqrt(2) * turning.rms / abs(turning.mean)
    if moves <= STEADY:
        return shown
    said = f"{turning.name} changes by {100 * moves:.2g} % within the window, so lines smear; use --waterfall"
    return replace(shown, warnings=(*shown.warnings, said))


# -- a file --------------------------------------------------------------------------------------


def _of_file(options: argparse.Namespace) -> int:
    path = Path(options.source)
    given = {
        "--set": options.set, "--stop": options.stop, "--start": options.start, "--solver": options.solver,
        "--rtol": options.rtol, "--compile": options.compile is not None, "--periodic": options.periodic,
        "--waterfall": options.waterfall,
    }  # fmt: skip
    for name, value in given.items():
        if value:
            raise InputError(f"{name}: {path} is a result, which is not run again; name the circuit instead")
    t, columns, units, attributes = read_series(path)
    series = Series(str(path), t, columns, units)
    names = matching(options.variables, list(columns), "variable")
    text = _period(options)
    if text is None:
        raise InputError(f"{path}: a result does not say its period; write --period '2.5 ms' or --frequency '400 Hz'")
    period = _parsed("--period", time, text) if isinstance(text, str) else text
    if not period > 0:
        raise InputError(f"--period {text} must be above 0")
    shaft: float | None = None
    shown = Shown(str(attributes.get("title") or path.stem), Path(path.stem), dict(DISPLAY))
    speeds = [name for name in columns if units.get(name) == speed.si]
    if options.orders in speeds:
        turning = spectra_of_rows(series, [options.orders], period, **_taken(options))[0]
        shaft, shown = abs(turning.mean), _steady_shaft(turning, shown)
    elif options.orders and is_number(options.orders):
        shaft = _turning(_parsed("--orders", speed, options.orders), options.orders)
    elif options.orders:
        raise InputError(f"--orders {options.orders}: no shaft speed of this name: {nearest(options.orders, speeds)}")
    return _tell(spectra_of_rows(series, names, period, **_taken(options)), shaft, shown, options)


# -- what is printed -----------------------------------------------------------------------------


def _tell(found: list[Spectrum], shaft: float | None, shown: Shown, options: argparse.Namespace) -> int:
    written: list[Path] = []
    target = Path(options.output) if options.output else None
    if target is not None:
        written.append(target)
        everything = report(found, shaft, shown, max(each.frequency.size for each in found))
        _write(target, everything, spectrum_rows(found, shaft))
    if options.plot:
        written.append((target.with_suffix("") if target else Path(f"{shown.stem}-spectrum")).with_suffix(".png"))
        plot_spectra(found, [shown.unit(each.quantity) for each in found], written[-1], shown.title, shaft)
    _print(report(found, shaft, shown, options.lines), summary(found, shaft, shown, options.lines), written, options)
    return DONE


def _print(facts: dict[str, Any], text: str, written: list[Path], options: argparse.Namespace) -> None:
    if options.json:
        print(json.dumps({**facts, "files": [str(path) for path in written]}, indent=2))
    elif not options.quiet:
        print("\n\n".join([text, "\n".join(f"  wrote {path}" for path in written)] if written else [text]))


def _write(path: Path, facts: dict[str, Any], rows: Iterable[Sequence[Any]]) -> None:
    if path.suffix == ".json":
        write_text(path, json.dumps(facts, indent=2) + "\n")
    else:
        write_rows(path, rows)


# -- waterfalls ----------------------------------------------------------------------------------


def _tell_waterfalls(found: list[Waterfall], shown: Shown, options: argparse.Namespace) -> int:
    written: list[Path] = []
    target = Path(options.output) if options.output else None
    if target is not None:
        written.append(target)
        _write(target, waterfall_report(found, shown, None), waterfall_rows(found))
    stem = target.with_suffix("") if target else Path(f"{shown.stem}-waterfall")
    for k, each in enumerate(found if options.plot else []):
        written.append(stem.with_name(f"{stem.name}{f'-{k + 1}' if len(found) > 1 else ''}.png"))
        plot_waterfall(each, shown.unit(each.quantity), (speed, shown.unit(speed)), written[-1], shown.title)
    text = "\n\n".join([shown.title, *(waterfall_text(each, shown, options.lines) for each in found)])
    _print(waterfall_report(found, shown, options.lines), text, written, options)
    return DONE
