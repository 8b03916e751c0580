"""Says of a run that dies at once that its start values contradict each other, and what to begin from instead."""

from __future__ import annotations

import re

from crescentlab.domain import HYDRAULIC
from crescentlab.result import Result
from crescentlab.units import QUANTITIES, pressure

FIRST = 0.01
"""Share of its span within which a run dies of its start."""
EQUAL = 1e3
"""Start pressures that differ by less [Pa] do not contradict each other."""


def advice(result: Result, span: float) -> str:
    """A sentence for a run of ``span`` [s] that failed in its beginning in a hydraulic part; otherwise nothing.

    Compared are the pressures of volumes and lines, and those that sources give; a tank's 0 bar contradicts nothing.
    """
    t, system = result.trajectory.steps.t, result.system
    hydraulic = {
        name for name, c in system.plan.components.items() if any(p.domain is HYDRAULIC for p in type(c).ports())
    }
    blamed = {word.rpartition(".")[0] for word in re.findall(r"[A-Za-z_][\w.]*\.[A-Za-z_]\w*", result.trajectory.error)}
    if not t.size or t[-1] - t[0] > FIRST * span or not blamed & hydraulic:
        return ""
    begin: dict[str, float] = {}
    for name, quantity, value in zip(system.state_names, system.state_quantities, result.values.x0, strict=True):
        if quantity is pressure and name.rpartition(".")[0] in hydraulic:
            begin[name] = float(value)
    for net in system.plan.graph.nets:
        column = f"{net.name.partition('[')[0]}.p{'[' + net.name.partition('[')[2] if '[' in net.name else ''}"
        if net.domain is HYDRAULIC and column in result and (given := float(result[column][0])):
            begin[column] = given
    circuit = result.design.netlist.name
    rest = (
        f"Begin at rest: simulation: {{start: steady}} in the circuit, or crescentlab steady {circuit} and then "
        f"--start {circuit}_steady.nc"
    )
    low, high = min(begin, key=begin.__getitem__, default=""), max(begin, key=begin.__getitem__, default="")
    if low and begin[high] - begin[low] > EQUAL:
        unit = result.display_unit(QUANTITIES["pressure"])
        least, most = (pressure.show(begin[name], unit, 4) for name in (low, high))
        return f"; it died of its start, where pressures contradict each other ({low} {least}, {high} {most}). {rest}"
    return f"; it died in the first per cent of its run, so its start values are far from any balance. {rest}"
