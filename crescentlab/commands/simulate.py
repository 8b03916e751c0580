"""``crescentlab simulate``: integrate a circuit, write its result, print a summary."""

from __future__ import annotations

import argparse
import json
import logging
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from crescentlab import plotting
from crescentlab.balance import Balance, Number
from crescentlab.circuit import Circuit, load
from crescentlab.cli import DONE, FAILED, INTERRUPTED
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import counted, settings, table
from crescentlab.result import Result, check_record
from crescentlab.series_files import result_target
from crescentlab.units import QUANTITIES
from crescentlab.verification import Verification

log = logging.getLogger("crescentlab")

EXIT_CODES = {"done": DONE, "stopped": DONE, "failed": FAILED, "interrupted": INTERRUPTED}
MAX_NETS = 12
"""Most net pressures listed in the summary."""
ROUNDING = 1e-12
"""Numbers of the summary below this share of their series' largest are zero."""
MAX_HOT = 4
"""Most components listed that turn energy into heat."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument("--stop", metavar="T", help="end time, for example '50 ms'")
    shared.start(parser)
    shared.solver(parser)
    parser.add_argument("--output-step", metavar="DT", help="uniform output grid, for example '0.1 ms'")
    shared.result_file(parser)
    parser.add_argument(
        "--record", action="append", default=[], metavar="GLOB", help="variables to write; only * and ? are wild"
    )
    parser.add_argument(
        "--verify", action="store_true", help="run again at a tenth of the tolerance, and say how far the two are apart"
    )
    parser.add_argument("--plot", action="store_true", help="write the circuit's plots as PNG files beside the result")
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    values = settings(options.set)
    circuit = load(options.circuit, no_code=options.no_code)
    target = result_target(options.output, circuit.netlist.name)
    _check_before(circuit, values, options)
    with progress_bar(options.quiet) as progress:
        result = circuit.simulate(
            options.stop, values, solver=options.solver, rtol=options.rtol, output_step=options.output_step,
            compile=options.compile, start=options.start, progress=progress, check=False,
            verify=options.verify,
        )  # fmt: skip
    status = result.trajectory.status
    log.info("integrated in %.3f s: %s", result.trajectory.statistics.wall_s, status)
    if target is not None:
        result.write(target, options.record)
        log.info("wrote %s", target)
    pictures = (
        plotting.write_plots(result, (target or Path(circuit.netlist.name)).with_suffix("")) if options.plot else []
    )
    if options.json:
        print(json.dumps(finite(report(result, target)), indent=2))
    elif not options.quiet:
        print(summary(result, target, options.record, pictures))
    if EXIT_CODES[status] != DONE:
        print(result.trajectory.error, file=sys.stderr)
    return EXIT_CODES[status]


def _check_before(circuit: Circuit, values: dict[str, str], options: argparse.Namespace) -> None:
    """Find before the run what would fail after it: globs and plots that name nothing."""
    system = circuit.system(values)
    log.info("assembled in %.3f s: %s", circuit.assembly_s, counted(len(system.state_names), "state"))
    check_record(system, options.record)
    if options.plot:
        plotting.check_plots(circuit.netlist, system)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[float], None] | None]:
    """A bar on stderr if that is a terminal, otherwise nothing."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(
        total=1.0, bar_format="{percentage:3.0f} %|{bar}| {elapsed} < {remaining}", leave=False, file=sys.stderr
    ) as bar:

        def show(share: float) -> None:
            bar.n = min(share, 1.0)
            bar.refresh()

        yield show


# -- what is printed -----------------------------------------------------------------------------


def report(result: Result, target: Path | None) -> dict[str, Any]:
    """The object of ``--json``."""
    t, balance = result.trajectory, result.balance
    s = t.statistics
    return {
        "status": t.status, "final_time": float(t.steps.t[-1]), "wall_s": s.wall_s, "steps": s.steps,
        "evaluations": s.evaluations, "jacobians": s.jacobians, "events": s.events, "ticks": s.ticks,
        "restarts": s.restarts, "states": len(result.system.state_names),
        "balance": balance.as_json() if balance else None, "warnings": result.warnings,
        "verify": result.verification.as_json() if result.verification else None,
        "file": str(target) if target else None, "error": t.error or None,
    }  # fmt: skip


def finite(value: Any) -> Any:
    """JSON knows no NaN: such numbers become null."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def summary(result: Result, target: Path | None, record: list[str], pictures: list[Path]) -> str:
    """The run in a few lines, quantities in display units."""
    parts = [result.title, table(_facts(result), indent="  ")]
    if rows := figures(result):
        more = len(result.net_pressures()) - MAX_NETS
        said = f"\n  and {counted(more, 'net')} more" if more > 0 else ""
        parts.append(table(rows, right=(2, 3, 4, 5), indent="  ") + said)
    if result.verification:
        parts.append(verified(result.verification))
    parts += [f"  warning: {warning}" for warning in result.warnings]
    written = [f"  wrote {path}" for path in pictures]
    if target is not None:
        names = counted(len(result.chosen(record)), "variable")
        written.insert(0, f"  wrote {target}: {counted(result.time.size, 'row')}, {names}")
    return "\n\n".join([*parts, "\n".join(written)] if written else parts)


def verified(found: Verification) -> str:
    """The error estimate of each output, the largest first."""
    rows: list[tuple[str, ...]] = [("error estimate", "largest", "share of range", "at")]
    for output in found.outputs[:MAX_NETS]:
        when = QUANTITIES["time"].show(output.time, "ms")
        rows.append((output.name, found.amount(output), f"{output.share:.1e}", when))
    more = len(found.outputs) - MAX_NETS
    said = f"\n  and {counted(more, 'output')} more, all nearer" if more > 0 else ""
    agrees = "they agree" if found.agrees else "they do NOT agree"
    head = f"  verified at rtol {found.tighter:g} against {found.rtol:g}: {agrees}"
    return f"{head}\n{table(rows, right=(1, 2, 3), indent='  ')}{said}"


def _facts(result: Result) -> list[tuple[str, str]]:
    """What the run took."""
    t, s = result.trajectory, result.trajectory.statistics
    time, states = QUANTITIES["time"], len(result.system.state_names)
    end = time.show(float(t.steps.t[-1]), result.display_unit(time))
    work = f"{counted(s.steps, 'step')}, {counted(s.evaluations, 'evaluation')}, {counted(s.jacobians, 'Jacobian')}"
    rows = [
        ("end", end if t.status == "done" else f"{end}, {t.status}"),
        ("solver", f"{t.solver}: {work}, {counted(s.restarts, 'restart')} in {s.wall_s:.3g} s"),
        ("model", "; ".join((counted(states, "state"), counted(s.events, "event"), counted(s.ticks, "tick")))),
    ]
    if result.balance is not None:
        rows += _ledgers(result.balance)
    rows += [("balance", f"none: {name}: {why}") for name, why in result.unbalanced.items()]
    return rows


def _ledgers(balance: Balance) -> Iterator[tuple[str, str]]:
    """How well the ledgers of fluid and energy close, and where the energy went."""

    def closes(what: str, circuit: Number, components: dict[str, Number]) -> str:
        errors = {name: error for name, error in components.items() if error is not None}
        worst = max(errors, key=lambda name: errors[name]) if errors else None
        if circuit is None:
            return f"{what} not determined: {', '.join(name for name in components if name not in errors)}"
        return f"{what} {circuit:.1e}" + (f", at most {errors[worst]:.1e} ({worst})" if worst else "")

    energy, told = balance.energy, []
    if balance.components:
        told.append(closes("of the flow", balance.circuit, balance.components))
    if energy is not None:
        told.append(closes("of the power", energy.circuit, energy.components))
    yield "balance", "; ".join(told)
    merged = total(balance.merged.values())
    if merged:
        yield "merged", f"{QUANTITIES['volume'].show(merged, 'cm3', 3)} moved by events"
    if energy is None:
        return
    taken = sum(e for e in energy.supplied.values() if e is not None and e < 0)
    amounts: list[tuple[Number, str]] = [
        (total(e for e in energy.supplied.values() if e is None or e > 0), "{} supplied"),
        *([(-taken, "{} taken out")] if taken else []),
        (total(energy.dissipated.values()), "{} to heat"),
        (energy.stored, "{} stored"),
    ]
    if (lost := total(energy.at_events.values())) != 0:
        amounts.append((lost, "of it {} at events"))
    if energy.silent:
        into = next(iter(energy.silent)) if len(energy.silent) == 1 else f"{len(energy.silent)} parts without books"
        amounts.append((total(energy.silent.values()), f"{{}} into {into}"))
    shown = [text.format(_joules(amount)) for amount, text in amounts if amount is not None]
    unknown = [text.replace("{} ", "") for amount, text in amounts if amount is None]
    yield "energy", ", ".join(shown) + _undetermined(unknown)
    hottest = sorted(((n, e) for n, e in energy.dissipated.items() if e is not None), key=lambda item: -abs(item[1]))
    unknown = [name for name, amount in energy.dissipated.items() if amount is None]
    if len(energy.dissipated) > 1 or unknown:
        more = f", {len(hottest) - MAX_HOT} more" if len(hottest) > MAX_HOT else ""
        named = ", ".join(f"{_joules(amount)} {name}" for name, amount in hottest[:MAX_HOT])
        yield "heat", named + more + _undetermined(unknown, "; " if named else "")


def _undetermined(names: list[str], before: str = "; ") -> str:
    """What of a ledger's row is no finite number."""
    return f"{before}not determined: {', '.join(names)}" if names else ""


def total(amounts: Iterable[Number]) -> Number:
    """Their sum; None if one of them is not determined."""
    known: list[float] = []
    for amount in amounts:
        if amount is None:
            return None
        known.append(amount)
    return sum(known)


def _joules(amount: float) -> str:
    """An energy in J or kJ."""
    return QUANTITIES["energy"].show(amount, "kJ" if abs(amount) >= 1e3 else "J", 3)


def figures(result: Result) -> list[tuple[str, ...]]:
    """Outputs and net pressures: unit, last value, mean, least, largest; of the steps, not of the output grid."""
    result = result.by_steps
    names = [o.name for o in result.design.outputs if o.scope == ""] + result.net_pressures()[:MAX_NETS]
    columns = [n for name in names for n in result.elements(name)]
    result.load(names)
    rows: list[tuple[str, ...]] = [("", "", "end", "mean", "min", "max")] if columns else []
    for name in columns:
        quantity, series = result.quantity(name), result[name]
        unit = result.display_unit(quantity)
        numbers = np.array([series[-1], result.mean(name), series.min(), series.max()])
        numbers[np.abs(numbers) < ROUNDING * max(np.abs(series).max(), ROUNDING * quantity.nominal)] = 0.0
        rows.append((name, "" if unit == "1" else unit, *[_scaled(quantity.show(float(v), unit)) for v in numbers]))
    return rows


def _scaled(shown: str) -> str:
    return shown.partition(" ")[0]
