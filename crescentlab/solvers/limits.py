"""Pressures that no fluid can have."""

from __future__ import annotations

import numpy as np

from crescentlab import units
from crescentlab.domain import HYDRAULIC
from crescentlab.energy import fluids_asked
from crescentlab.errors import SimulationError
from crescentlab.system import System


class PressureLimits:
    """Pressures below absolute zero end a run, or warn where the fluid may be under tension."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.states = self.of(system.state_names, system.state_quantities)
        self.held = self.of(system.held_names, system.held_quantities)
        self.seen_h: np.ndarray | None = None

    def of(
        self, names: list[str], quantities: list[units.Quantity]
    ) -> tuple[np.ndarray, np.ndarray, list[str], list[bool]]:
        """Places, lowest possible values, names, and whether tension is allowed, of all fluid pressures."""
        plan = self.system.plan
        found = []
        for k, (name, quantity) in enumerate(zip(names, quantities, strict=True)):
            owner = name.rpartition(".")[0]
            hydraulic = any(p.domain is HYDRAULIC for p in type(plan.components[owner]).ports())
            asked = fluids_asked(type(plan.components[owner]))
            if quantity is units.pressure and hydraulic and asked:
                fluid = plan.design.fluids[plan.fluids[owner][asked[0]]]
                found.append((k, -fluid.atmospheric_pressure * (1 + 1e-9), name, fluid.tension))
        places, floors, shown, tension = zip(*found, strict=True) if found else ((), (), (), ())
        lowest = np.full(len(names), -np.inf)
        lowest[list(places)] = floors
        return np.array(places, dtype=int), lowest, list(shown), list(tension)

    @property
    def ending(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest values of states and of held values that do not end the run: none where tension is allowed."""
        found = []
        for places, floors, _, tension in (self.states, self.held):
            kept = floors.copy()
            kept[places[np.array(tension, bool)]] = -np.inf
            found.append(kept)
        return found[0], found[1]

    def check(self, t: float, x: np.ndarray, h: np.ndarray) -> str | None:
        """A warning, or an error raised; None if all pressures are possible."""
        warning = self.look(t, x, *self.states)
        if h is not self.seen_h:
            self.seen_h = h
            warning = warning or self.look(t, h, *self.held)
        return warning

    def look(
        self,
        t: float,
        vector: np.ndarray,
        places: np.ndarray,
        floors: np.ndarray,
        names: list[str],
        tension: list[bool],
    ) -> str | None:
        if not np.count_nonzero(vector < floors):
            return None
        below = np.flatnonzero(vector[places] < floors[places])
        k = int(next((j for j in below if not tension[j]), below[0]))
        said = (
            f"{names[k]} is {units.pressure.show(vector[places][k], 'bar')} gauge at {t:.6g} s, below absolute zero "
            f"({units.pressure.show(floors[places[k]], 'bar')})"
        )
        if not tension[k]:
            raise SimulationError(
                f"{said}; the oil would cavitate: feed this volume better, choose a fluid that evaporates, or write "
                "tension: true in the fluid to go on"
            )
        return said
