"""Signals that went beyond the range of the port that takes them: equations saw them held, and the user is told."""

from __future__ import annotations

import casadi as ca
import numpy as np

from crescentlab.domain import Port
from crescentlab.solvers.trajectory import Rows
from crescentlab.symbols import column
from crescentlab.system import System
from crescentlab.units import DISPLAY

Array = np.ndarray

MARGIN = 1e-3
"""Of the usual size of the quantity: a signal that is this far beyond its range is told."""
PERCENT = 1.5
"""A share beyond this was probably meant in per cent."""
BLOCK = 65536
"""Rows that are looked at together."""


def beyond_ranges(system: System, p: Array, rows: Rows) -> list[str]:
    """One sentence for each port whose signal went beyond its range in these rows: value, time, what was counted."""
    fixed, moving = system.once("ranged", lambda: _ranged(system))
    told = []
    for names, some in ((fixed, _first(rows)), (moving, rows)):
        if names:
            told += _told(system, names, p, some)
    return told


def _ranged(system: System) -> tuple[dict[str, Port], dict[str, Port]]:
    """Ranged signals by name: those that parameters alone decide, and those that change in a run."""
    fixed: dict[str, Port] = {}
    moving: dict[str, Port] = {}
    changing = ca.vertcat(system.t, system.x, system.h, system.b)
    for part, component in system.plan.components.items():
        for port in type(component).ports():
            if port.ranged and (elements := system.find(f"{part}.{port.name}").expression()):
                depends = ca.depends_on(column(elements), changing)
                (moving if depends else fixed)[f"{part}.{port.name}"] = port
    return fixed, moving


def _first(rows: Rows) -> Rows:
    return Rows(rows.t[:1], rows.x[:1], rows.h[:1], rows.b[:1], rows.jumps[:0])


def _told(system: System, ports: dict[str, Port], p: Array, rows: Rows) -> list[str]:
    owners = [(name, k) for name in ports for k, _ in enumerate(system.find(name).expression())]
    low = np.array([_limit(ports[name].low, -np.inf) for name, _ in owners])[:, None]
    high = np.array([_limit(ports[name].high, np.inf) for name, _ in owners])[:, None]
    furthest, value, when = (np.zeros(len(owners)) for _ in range(3))
    for begin in range(0, rows.t.size, BLOCK):
        t, x, h, b = (each[begin : begin + BLOCK] for each in rows.arrays())
        series = system.series(list(ports), t, x, h, b, p)
        beyond = np.maximum(np.fmax(series - high, low - series), 0.0)
        at = np.argmax(beyond, axis=1)
        every = np.arange(at.size)
        further = beyond[every, at] > furthest
        furthest[further] = beyond[every, at][further]
        value[further], when[further] = series[every, at][further], t[at][further]
    told = []
    for name, port in ports.items():
        mine = [j for j, (owner, _) in enumerate(owners) if owner == name]
        worst = max(mine, key=lambda j: furthest[j])
        if furthest[worst] > MARGIN * system.find(name).quantity.nominal:
            element = f"[{owners[worst][1] + 1}]" if system.find(name).vector else ""
            told.append(_sentence(system, name + element, port, float(value[worst]), float(when[worst]), name))
    return told


def _limit(given: float | None, otherwise: float) -> float:
    return otherwise if given is None else given


def _sentence(system: System, element: str, port: Port, value: float, t: float, name: str) -> str:
    quantity = system.find(name).quantity
    unit = DISPLAY.get(quantity.name, "" if quantity.si == "1" else None)

    def show(number: float) -> str:
        return quantity.show(number, unit)

    if port.low is None or port.high is None:
        limit = f"{'at least' if port.high is None else 'at most'} {show(port.low if port.high is None else port.high)}"  # type: ignore[arg-type]
    else:
        limit = f"{show(port.low)}..{show(port.high)}"
    said = f"{element} went to {show(value)} (at {t:.4g} s) and was clamped to {limit}"
    if quantity.name == "ratio" and PERCENT < abs(value) <= 100:
        said += f"; write {value / 100:g} for {value:g} %"
    return said
