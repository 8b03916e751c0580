"""``crescentlab sensitivity``: derivatives of outcomes by parameters."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

from crescentlab.analysis.outcome import Outcome
from crescentlab.analysis.sensitivity import METHODS, Sensitivities, in_units, sensitivities
from crescentlab.circuit import load
from crescentlab.cli import DONE
from crescentlab.commands import arguments as shared
from crescentlab.commands.text import settings, table, wrapped
from crescentlab.errors import InputError, UnitError
from crescentlab.files import check_writable, write_rows, write_text
from crescentlab.units import QUANTITIES, Quantity

KEYS = (
    "outcome", "value", "value_unit", "parameter", "at", "at_unit", "derivative", "unit", "relative", "error", "method",
    "reason",
)  # fmt: skip
"""Of each derivative, in files and with ``--json``; numbers in SI."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    shared.circuit(parser)
    parser.add_argument(
        "--outcome", action="append", default=[], metavar="EXPRESSION", help="what to differentiate: 'mean(delivery.p)'"
    )
    parser.add_argument("--parameter", action="append", default=[], metavar="NAME", help="by what: a name as for --set")
    parser.add_argument("--stop", metavar="T", help="end time, for example '50 ms'")
    parser.add_argument("--from", dest="begin", metavar="T", help="outcomes count from this time on")
    parser.add_argument("--method", default="auto", metavar="NAME", help=f"{', '.join(METHODS)}; default: auto")
    shared.start(parser)
    shared.solver(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help=".csv or .json")
    shared.json(parser)


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    target = _target(options.output)
    begin = _time(options.begin)
    found = sensitivities(
        load(options.circuit, no_code=options.no_code), [Outcome(text, text) for text in options.outcome],
        options.parameter, settings(options.set), stop=options.stop, window=(begin, None), method=options.method,
        start=options.start, solver=options.solver or "rodas", rtol=options.rtol, compile=options.compile,
    )  # fmt: skip
    every = rows(found)
    written = {"status": "done", "circuit": options.circuit, "sensitivities": every, "warnings": _warnings(found)}
    if target is not None and target.suffix == ".csv":
        write_rows(target, [KEYS, *([row[key] for key in KEYS] for row in every)])
    elif target is not None:
        write_text(target, json.dumps(written, indent=2) + "\n")
    if options.json:
        print(json.dumps({**written, "file": str(target) if target else None, "error": None}, indent=2))
    else:
        print(summary(found, target))
    return DONE


def _target(output: str | None) -> Path | None:
    """The file to write, checked before the run."""
    if output is None:
        return None
    target = Path(output)
    check_writable(target, (".csv", ".json"), f"the suffix {target.suffix!r} is neither .csv nor .json")
    return target


def _time(text: str | None) -> float | None:
    try:
        return None if text is None else QUANTITIES["time"].parse(text)
    except UnitError as error:
        raise InputError(f"--from {error.message}") from None


def _warnings(found: Sensitivities) -> list[str]:
    return list(found.result.trajectory.warnings)


# -- what is printed -----------------------------------------------------------------------------


def rows(found: Sensitivities) -> list[dict[str, Any]]:
    """One object for each derivative, numbers in SI; what is not known is None."""
    relative = found.relative
    return [
        dict(zip(KEYS, (
            outcome.text, float(found.values[i]), quantity.si, parameter.name, parameter.value, parameter.quantity.si,
            float(found.derivative[i, j]), _per(quantity.si, parameter.quantity.si), _known(relative[i, j]),
            _known(found.error[i, j]), found.method[j], found.reason[j],
        ), strict=True))
        for i, (outcome, quantity) in enumerate(zip(found.outcomes, found.quantities, strict=True))
        for j, parameter in enumerate(found.parameters)
    ]  # fmt: skip


def _known(value: float) -> float | None:
    return float(value) + 0.0 if math.isfinite(value) else None


def _per(unit: str, by: str) -> str:
    """The unit of a derivative: ``bar per mm2``."""
    return unit if by in ("", "1") else f"{unit or '1'} per {by}"


def summary(found: Sensitivities, target: Path | None) -> str:
    """Derivatives in display units, relative sensitivities, and how each parameter's were made."""
    parts = [found.result.title, *[_table(found, row) for row in range(len(found.outcomes))]]
    ways: dict[tuple[str, str], list[str]] = {}
    for parameter, way in zip(found.parameters, zip(found.method, found.reason, strict=True), strict=True):
        ways.setdefault(way, []).append(parameter.name)
    parts.append(
        "\n".join(
            wrapped(f"  {'all' if len(ways) == 1 else ', '.join(names)}: ", f"{method}; {reason}")
            for (method, reason), names in ways.items()
        )
    )
    parts += [f"  warning: {warning}" for warning in _warnings(found)]
    return "\n\n".join([*parts, f"  wrote {target}"] if target else parts)


def _table(found: Sensitivities, row: int) -> str:
    """One outcome and its derivatives; with differences their estimated errors."""
    outcome, quantity = found.outcomes[row], found.quantities[row]
    unit = _unit(found, quantity)
    estimated = any(math.isfinite(error) for error in found.error[row])
    lines = [["", "at", "derivative", "", "% per %"] + ["error"] * estimated]
    for j, parameter in enumerate(found.parameters):
        by = _unit(found, parameter.quantity)
        units = (quantity, parameter.quantity, (unit, by))
        error = in_units(float(found.error[row, j]), *units)
        lines.append([
            parameter.name, parameter.quantity.show(parameter.value, by, 6),
            f"{in_units(float(found.derivative[row, j]), *units):.6g}", _per(unit, by),
            _shown(float(found.relative[row, j]) + 0.0, 5),  # no -0
        ] + [_shown(error, 1)] * estimated)  # fmt: skip
    shown = quantity.show(float(found.values[row]), unit, 6)
    return f"  {outcome.text} = {shown}\n" + table(lines, right=(1, 2, 4, 5), indent="    ")


def _shown(value: float, digits: int) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _unit(found: Sensitivities, quantity: Quantity) -> str:
    unit = found.result.display_unit(quantity)
    return "" if unit == "1" else unit
