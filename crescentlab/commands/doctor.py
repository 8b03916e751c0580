"""``crescentlab doctor``: what is fast, what is slow, what limits the step, what carries the energy."""

from __future__ import annotations

import argparse
import json
import math

from crescentlab.analysis.doctor import Examination, advice, bound_of, examine, hertz_text, mode_text, report, time_text
from crescentlab.analysis.doctor.line_errors import LineError
from crescentlab.analysis.linear.modes import Mode
from crescentlab.circuit import load
from crescentlab.cli import DONE
from crescentlab.commands import arguments as shared
from crescentlab.commands.simulate import progress_bar
from crescentlab.commands.text import counted, settings, table, wrapped

FASTEST, SLOWEST = 3, 3
ROWS = 12
"""Most components, states and events listed."""
TAKING_PART, LEAST_SHARE = 3, 0.01
"""Most states named with a mode, and the least share of one."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument("--stop", metavar="T", help="end time of the run, for example '50 ms'")
    parser.add_argument("--rtol", metavar="R", type=shared.number, help="relative tolerance of every state")
    parser.add_argument("--period", metavar="T", help="period whose harmonics lines must carry; default: the circuit's")
    parser.add_argument("--line-error", metavar="R", default="5 %", help="largest error of a line let pass ('5 %%')")
    parser.add_argument(
        "--compile", action=argparse.BooleanOptionalAction, help="compile the equations; by default where it pays"
    )
    shared.json(parser)
    shared.quiet(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    bound = bound_of(options.line_error)
    values = settings(options.set)
    circuit = load(options.circuit, no_code=options.no_code)
    with progress_bar(options.quiet) as progress:
        found = examine(
            circuit, values, stop=options.stop, rtol=options.rtol, period=options.period, line_error=bound,
            compile=options.compile, progress=progress,
        )  # fmt: skip
    if options.json:
        print(json.dumps(report(found), indent=2))
    elif not options.quiet:
        print(told(found))
    return DONE


def told(found: Examination) -> str:
    """The examination as text."""
    parts = [found.result.title, _run(found), _modes(found), _limits(found), _events(found), _energy(found)]
    parts += [_lines(found), _advice(found), *(f"  warning: {w}" for w in found.result.trajectory.warnings)]
    return "\n\n".join(part for part in parts if part)


def _run(found: Examination) -> str:
    s = found.result.trajectory.statistics
    work = f"{counted(s.steps, 'step')}, {s.rejected} rejected, {counted(s.restarts, 'restart')}"
    rows = [
        ("run", f"{time_text(found.span)} with {found.result.trajectory.solver}: {work}"),
        ("model", "; ".join((counted(len(found.result.system.state_names), "state"), counted(s.events, "event"),
                             counted(s.ticks, "tick")))),
    ]  # fmt: skip
    return table(rows, indent="  ")


def _modes(found: Examination) -> str:
    at = found.instants[-1]
    if not at.eigenvalues.size:
        return "  no modes: nothing in this circuit moves by itself at the end of the run"
    order = [int(k) for k in at.by_speed]
    shown = order if len(order) <= FASTEST + SLOWEST else [*order[:FASTEST], -1, *order[-SLOWEST:]]
    rows = [("mode", "damping", "dies out in", "states")]
    rows += [("...", "", "", "") if k < 0 else _mode_row(at.mode(k)) for k in shown]
    said = f"  modes at the end, {time_text(at.time)}, the fastest first; stiffness {at.stiffness:.3g}"
    if len(found.instants) > 1:
        ratios = [f"{m.stiffness:.3g} at {time_text(m.time)}" for m in found.instants[:-1]]
        said += f" ({', '.join(ratios)})"
    ticking = ", ".join(f"{name} ({counted(n, 'value')})" for name, n in found.ticking.items())
    held = f"\n\n  stepped by ticks, and without modes here: {ticking}" if ticking else ""
    missing = f"\n\n  {at.left_out} states depend on each other at once, too many for modes" if at.left_out else ""
    return f"{said}\n\n{table(rows, indent='    ')}{held}{missing}"


def _mode_row(mode: Mode) -> tuple[str, str, str, str]:
    hertz = hertz_text(mode.natural_frequency / (2 * math.pi))
    taking = [(name, share) for name, share in mode.parts.items() if share >= LEAST_SHARE][:TAKING_PART]
    states = ", ".join(f"{name} {100 * share:.0f} %" for name, share in taking)
    states = states or f"spread over {counted(len(mode.parts), 'state')}"
    real = mode.eigenvalue.real
    dies = "grows" if real > 0 else "never" if real == 0 else time_text(-1 / real)
    damping = f"{mode.damping_ratio:.2g}" if mode.eigenvalue.imag else "no swing"
    return hertz, damping, dies, states


def _limits(found: Examination) -> str:
    if found.limits is None:
        return "  which state limited the steps is not known: the compiled loop counts it, which needs a C compiler"
    if not found.limits:
        return ""
    rows = [("limited", "state", "its part in the circuit")]
    rows += [
        (f"{100 * each.share:.0f} %", each.state, mode_text(each.mode) if each.mode else "only adds up")
        for each in found.limits[:ROWS]
    ]
    return table(rows, right=(0,), indent="  ")


def _events(found: Examination) -> str:
    if not found.happened:
        return "  no events"
    rows = [("happened", "component", "events and ticks")]
    rows += [
        (str(sum(events.values())), owner, ", ".join(f"{name} {count}" for name, count in events.items()))
        for owner, events in list(found.happened.items())[:ROWS]
    ]
    return table(rows, right=(0,), indent="  ")


def _energy(found: Examination) -> str:
    shares = [(name, share) for name, share in found.index.items() if share > 0]
    if not shares:
        return ""
    rows = [("activity", "", "component")]
    rows += [(f"{found.activity[name]:.3g} J", f"{100 * share:.2g} %", name) for name, share in shares[:ROWS]]
    more = len(found.index) - min(len(shares), ROWS)
    said = f"\n  and {counted(more, 'component')} with less" if more else ""
    return table(rows, right=(0, 1), indent="  ") + said


def _lines(found: Examination) -> str:
    if not found.lines:
        return ""
    rows = [("line", "type", "error", "at")]
    for line in found.lines:
        if line.errors.size:
            rows.append(
                (line.name, line.type, f"{100 * line.worst[0]:.3g} %", hertz_text(line.worst[1]) + _beyond(line))
            )
        else:
            rows.append((line.name, line.type, "", line.note))
    return table(rows, right=(2,), indent="  ")


def _beyond(line: LineError) -> str:
    """What was left out of the judgement of a line that ticks."""
    if not line.left_out:
        return ""
    above = ", ".join(hertz_text(f) for f in line.left_out[:TAKING_PART])
    more = ", ..." if len(line.left_out) > TAKING_PART else ""
    return f"; not judged above a quarter of its tick rate: {above}{more}"


def _advice(found: Examination) -> str:
    return "\n".join(wrapped("  - ", sentence) for sentence in advice(found))
