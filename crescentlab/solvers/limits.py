"""Pressures that no fluid can have, and those for which its law is not meant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from crescentlab import units
from crescentlab.closed_sets import closed_sets
from crescentlab.columns import Columns
from crescentlab.component import snake_case
from crescentlab.errors import SimulationError
from crescentlab.prepared import prepare
from crescentlab.pressures import CAVITATES, ROUNDING, fluid_number, own_pressures
from crescentlab.solvers.trajectory import Rows
from crescentlab.symbols import column
from crescentlab.system import System

Array = np.ndarray


@dataclass(frozen=True)
class Range:
    """Pressures of one kind, states, held values or given ones, and where their fluids' laws hold."""

    names: list[str]
    fluids: list[str | None]
    places: Array
    """Of the pressures in their vector."""
    floors: Array
    """Absolute zero as gauge pressure, one for each place."""
    highest: Array
    """Up to which the law is meant, one for each place."""
    tension: Array
    """Whether the fluid may be under tension, one for each place."""
    lowest: Array
    """Of the whole vector: absolute zero of pressures, else -inf."""

    @property
    def ending(self) -> Array:
        """Lowest values of the whole vector that do not end the run: none where tension is allowed."""
        kept = self.lowest.copy()
        kept[self.places[self.tension]] = -np.inf
        return kept


class PressureLimits:
    """Pressures below absolute zero end a run, or warn where the fluid may be under tension; too high ones warn."""

    def __init__(self, system: System, p: Array) -> None:
        self.system, self.p = system, p
        plan = system.plan
        numbers = [
            [fluid_number(plan, system.p, fluid, name) for name in ("atmospheric_pressure", "highest_pressure")]
            for fluid in (*plan.design.fluids, None)
        ]
        known = ca.Function("numbers", [system.p], [ca.vertcat(*(ca.horzcat(*each) for each in numbers))])(p)
        self.numbers = dict(zip((*plan.design.fluids, None), np.array(known).tolist(), strict=True))
        """Atmospheric and highest pressure of each fluid."""
        self.states = self.of(system.state_names, own_pressures(plan, system.state_names, system.state_quantities))
        self.held = self.of(system.held_names, own_pressures(plan, system.held_names, system.held_quantities))
        given = system.given
        self.given = self.of([each.name for each in given], [(k, each.fluid) for k, each in enumerate(given)])
        self.seen_h: Array | None = None

    def of(self, names: list[str], found: Sequence[tuple[int, str | None]]) -> Range:
        """The range of the pressures at the places of a vector that are found, each with its fluid."""
        places = np.array([k for k, _ in found], dtype=int)
        fluids = [fluid for _, fluid in found]
        air, highest = np.array([self.numbers[fluid] for fluid in fluids]).reshape(-1, 2).T
        laws = self.system.plan.design.fluids
        tension = np.array([bool(fluid and laws[fluid].tension) for fluid in fluids], dtype=bool)
        floors = -air * (1 + ROUNDING)
        lowest = np.full(len(names), -np.inf)
        lowest[places] = floors
        return Range([names[k] for k in places], fluids, places, floors, highest, tension, lowest)

    # -- while running ---------------------------------------------------------------------------

    def check(self, t: float, x: Array, h: Array) -> str | None:
        """A warning of tension, or an error raised; None if the pressures of states and held values are possible."""
        warning = self.look(t, x, self.states)
        if h is not self.seen_h:
            self.seen_h = h
            warning = warning or self.look(t, h, self.held)
        return warning

    def look(self, t: float, vector: Array, of: Range) -> str | None:
        """The same for one kind of pressures."""
        if not np.count_nonzero(vector < of.lowest):
            return None
        values = vector[of.places]
        below = np.flatnonzero(values < of.floors)
        k = int(next((j for j in below if not of.tension[j]), below[0]))
        warning = under_tension(of.names[k], float(values[k]), t, float(of.floors[k]))
        if not of.tension[k]:
            raise SimulationError(f"{warning}; {CAVITATES}")
        return warning

    # -- after a run, or where it failed ---------------------------------------------------------

    def warnings(self, rows: Rows) -> list[str]:
        """What a run says of tension, once, and of pressures for which its fluids' laws are not meant."""
        kinds = [(of, values) for of, values in self.series(rows) if of.places.size]
        return [*self.tension(rows, kinds), *self.too_high(rows, kinds)]

    def series(self, rows: Rows) -> list[tuple[Range, Array]]:
        """The pressures of each kind, each (rows, places)."""
        found = [(self.states, rows.x[:, self.states.places]), (self.held, rows.h[:, self.held.places])]
        if self.system.given:
            columns = self.system.once("given pressures", self.columns)
            [given] = columns((rows.t.reshape(1, -1), rows.x.T, rows.h.T, rows.b.T), self.p)
            found.append((self.given, given.T))
        return found

    def columns(self) -> Columns:
        """The given pressures as a function."""
        given = ca.densify(column([each.expression for each in self.system.given]))
        return Columns(prepare("given", self.system.arguments[:-1], self.system.p, [given], seldom=True))

    @staticmethod
    def tension(rows: Rows, kinds: list[tuple[Range, Array]]) -> list[str]:
        """The first pressure below absolute zero of a fluid that may be under tension."""
        found: list[tuple[int, str]] = []
        for of, values in kinds:
            if of.tension.any() and (below := (values < of.floors) & of.tension).any():
                row, k = (int(place) for place in np.argwhere(below)[0])
                warning = under_tension(of.names[k], float(values[row, k]), float(rows.t[row]), float(of.floors[k]))
                found.append((row, warning))
        return [min(found)[1]] if found else []

    def too_high(self, rows: Rows, kinds: list[tuple[Range, Array]]) -> list[str]:
        """For each fluid the first pressure that its law is not meant for, and a flow there without a way out."""
        passing: dict[str | None, list[tuple[float, Range, Array, int]]] = {}
        for of, values in kinds:
            for k in np.flatnonzero((values > of.highest).any(axis=0)).tolist():
                time = crossing(rows.t, values[:, k], float(of.highest[k]))
                passing.setdefault(of.fluids[k], []).append((time, of, values[:, k], k))
        warnings = []
        for fluid, found in passing.items():
            t, of, p, k = min(found, key=lambda each: each[0])
            limit, peak = float(of.highest[k]), int(np.nanargmax(p))
            worlds = [(float(rows.t[j]), rows.x[j], rows.h[j], rows.b[j]) for j in (int(np.argmax(p > limit)), peak)]
            out = self.way_out(*worlds[0]) or self.way_out(*worlds[1]) or "what the fluid does there is extrapolated"
            more = f" ({len(found) - 1} more follow)" if len(found) > 1 else ""
            warnings.append(
                f"{of.names[k]} passes {self.meant(fluid, limit)}, at {t:.6g} s and reaches "
                f"{units.pressure.show(float(p[peak]), 'bar')}{more}; {out}"
            )
        return warnings

    def meant(self, fluid: str | None, limit: float) -> str:
        """The limit of a fluid's law in words."""
        law = self.system.plan.design.fluids[str(fluid)]
        kind = snake_case(type(law).__name__)
        return f"{units.pressure.show(limit, 'bar')} gauge, up to which the law of {kind} is meant"

    def way_out(self, t: float, x: Array, h: Array, b: Array) -> str:
        """Flows without a way out at an instant, and what to do; '' if there are none."""
        if not (np.isfinite(x).all() and np.isfinite(h).all()):
            return ""
        flows = closed_sets(self.system, self.p).without_way_out(t, x, h, b)
        return f"{'; '.join(flows)}: give it one, for example a relief_valve" if flows else ""

    def beyond(self, t: float, x: Array, h: Array, b: Array) -> str | None:
        """The pressure that is furthest beyond what its fluid's law is meant for at an instant, and why; or None."""
        world = Rows(np.array([t]), x[None], h[None], b[None], np.zeros(0, int))
        found = [
            (float(p / limit), of, k, float(p))
            for of, values in self.series(world)
            for k, (p, limit) in enumerate(zip(values[0], of.highest, strict=True))
            if p > limit
        ]
        if not found:
            return None
        _, of, k, p = max(found, key=lambda each: each[0])
        high = f"is {units.pressure.show(p, 'bar')} gauge" if np.isfinite(p) else "grows beyond all bounds"
        out = self.way_out(t, x, h, b) or "look there for a flow without a way out, and give it one"
        return f"{of.names[k]} {high}, beyond {self.meant(of.fluids[k], float(of.highest[k]))}; {out}"


def under_tension(name: str, p: float, t: float, floor: float) -> str:
    """What is said of a pressure below absolute zero."""
    return (
        f"{name} is {units.pressure.show(p, 'bar')} gauge at {t:.6g} s, below absolute zero "
        f"({units.pressure.show(floor, 'bar')})"
    )


def crossing(t: Array, p: Array, limit: float) -> float:
    """When a series first passes a limit, on a line between two rows."""
    row = int(np.argmax(p > limit))
    if row == 0 or not t[row - 1] < t[row]:
        return float(t[row])
    return float(t[row] - (t[row] - t[row - 1]) * (p[row] - limit) / (p[row] - p[row - 1]))
