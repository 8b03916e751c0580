"""The ledgers of a run: fluid and energy that came in against what is stored more, per component.

.. math:: \\varepsilon = \\frac{\\left|\\int \\sum q \\, dt - \\Delta S\\right|}{\\max_i \\int \\sum |q_i| / 2 \\, dt},
          \\qquad \\varepsilon_E = \\frac{\\left|\\int \\left(\\sum P + P_s - P_d\\right) dt - \\Delta E\\right|}
          {\\max_i \\left(\\int \\sum |P_i| / 2 \\, dt, \\int P_d \\, dt\\right)}

S [m^3 at 0 bar gauge] is what the component's own law stores (its ``stores()`` observable); E [J] the energy in it
(``stores_energy()``), P [W] the power that enters at a port (:mod:`crescentlab.energy`), P_s that from outside the
circuit (``supplies()``), P_d that turned into heat (``dissipates()``). The divisors are no less than a millionth of the
largest S or E: at rest nothing flows but what the solver's tolerance leaves.

Jumps at events are booked apart: volumes that are merged or parted take their content along (``merged``), and what
strikes a stop loses its motion (``at_events``). The integrals use the solver's own interpolant at three Gauss nodes per
smooth piece.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from crescentlab.columns import Columns
from crescentlab.prepared import LARGE, prepare, shared
from crescentlab.solvers.trajectory import GAUSS_NODES, GAUSS_WEIGHTS, Trajectory
from crescentlab.symbols import column
from crescentlab.system import System, Values
from crescentlab.units import QUANTITIES

Array = np.ndarray
Number = float | None
"""An entry; None where it is not determined, for a rate of it is no finite number."""

UNEQUAL = 1e-9
"""Share of the flow through a component that keeps nothing by which entering and leaving may differ: rounding."""
COLD = 0.01
"""Share of the power through a component by which its loss may be negative: a fluid's compression and convection."""
AT_REST = 1e-6
"""Where less than this share of the largest content flows, errors are told as shares of that much."""


@dataclass(frozen=True)
class EnergyBalance:
    """Relative errors per component that keeps books of energy and for the circuit, and where the energy went [J]."""

    components: dict[str, Number]
    circuit: Number
    supplied: dict[str, Number]
    """From outside the circuit, per source or boundary; negative where energy left it there."""
    dissipated: dict[str, Number]
    """Turned into heat, per component that did so."""
    stored: Number
    """Change of what is stored."""
    at_events: dict[str, Number]
    """Gained by jumps at events, negative where an impact lost it; part of ``stored``."""
    silent: dict[str, Number]
    """What entered components that do not say what becomes of it."""

    def as_json(self) -> dict[str, object]:
        """Plain data for ``--json``."""
        return {
            "circuit": self.circuit,
            "components": self.components,
            "supplied": self.supplied,
            "dissipated": self.dissipated,
            "stored": self.stored,
            "at_events": self.at_events,
            "silent": self.silent,
        }


@dataclass(frozen=True)
class Balance:
    """Relative errors per storing component and for the circuit, content moved by events [m^3], and the energies."""

    components: dict[str, Number]
    circuit: Number
    merged: dict[str, Number]
    unequal: dict[str, float]
    """What entered more than left components that keep nothing [m^3]: their equations are wrong."""
    energy: EnergyBalance | None
    warnings: list[str]
    """What is wrong with components, in words."""

    def as_json(self) -> dict[str, object]:
        """Plain data for ``--json``."""
        return {
            "circuit": self.circuit,
            "components": self.components,
            "merged": {k: v for k, v in self.merged.items() if v},
            "unequal": self.unequal,
            "energy": self.energy.as_json() if self.energy else None,
        }


def balance(system: System, values: Values, trajectory: Trajectory) -> Balance | None:
    """Compute the ledgers; None if no step was made, or no component keeps books."""
    contents, energies, passing = system.contents(), system.energies(), system.passing()
    if not (contents or energies) or not len(trajectory.pieces.low):
        return None
    content, inflow, flow = (_rows(contents.values(), k) for k in range(3))
    energy, loss, supply, entering, power = (_rows(energies.values(), k) for k in range(5))
    fluid_change, energy_change = _changes(system, values, trajectory, [content, energy])
    net, size, left, most, lost, supplied, extra, through = _integrals(
        system, values, trajectory,
        [inflow, flow, entering + supply - loss, power, loss, supply, *(_rows(passing.values(), k) for k in range(2))],
    )  # fmt: skip
    most = np.maximum(most, np.abs(lost))
    unequal = {n: float(e) for n, e, q in zip(passing, extra, through, strict=True) if abs(e) > UNEQUAL * q}
    cold = [name for name, heat, p in zip(energies, lost, most, strict=True) if heat < -COLD * p]
    books = _kept(system, list(energies), left, most, lost, supplied, energy_change)
    errors = _errors(list(contents), net - fluid_change.smooth, size, fluid_change)
    lost_track = _not_determined("fluid", contents, {"flow": net, "content": fluid_change.total})
    entries = {"heat": lost, "supply": supplied, "power": left, "stored energy": energy_change.total}
    lost_track += _not_determined("energy", energies, entries)
    told = [*_told(unequal, cold), *lost_track]
    return Balance(*errors, _by_name(contents, fluid_change.moved), unequal, books, told)


def _not_determined(ledger: str, names: Iterable[str], entries: dict[str, Array]) -> list[str]:
    """Which entries of a ledger are no finite numbers, in one sentence."""
    found = [
        f"the {entry} of {name}"
        for k, name in enumerate(names)
        for entry, numbers in entries.items()
        if not np.isfinite(numbers[k])
    ]
    if not found:
        return []
    more = f" and {len(found) - 1} more" if len(found) > 1 else ""
    return [f"the ledger of {ledger} is not determined: {found[0]} is not a finite number{more}"]


def _told(unequal: dict[str, float], cold: list[str]) -> list[str]:
    """What the ledgers say against components."""
    volume = QUANTITIES["volume"]
    found = [
        f"{name}: {volume.show(abs(v), 'cm3', 3)} more {'entered than left' if v > 0 else 'left than entered'}; in its "
        "equations the flows at its ports must add up to 0"
        for name, v in unequal.items()
    ]
    return found + [f"{name}: its loss is negative; check the signs of its flows, forces and torques" for name in cold]


def _kept(
    system: System, names: list[str], left: Array, most: Array, lost: Array, supplied: Array, change: _Change
) -> EnergyBalance | None:
    """The ledger of energy; None if no component keeps books."""
    silent = set(system.silent())
    entered = {name: each for name, each in _by_name(names, left).items() if name in silent}
    if len(entered) == len(names):
        return None
    missing = np.where([name in silent for name in names], 0.0, left - change.smooth)
    errors, circuit = _errors(names, missing, most, change)
    return EnergyBalance(
        {name: error for name, error in errors.items() if name not in silent}, circuit, _nonzero(names, supplied),
        _nonzero(names, lost), _number(change.total.sum()), _nonzero(names, change.at_events), entered,
    )  # fmt: skip


def _rows(entries: Iterable[Any], k: int) -> ca.SX:
    """Row ``k`` of every component, a column."""
    return column([entry[k] for entry in entries])


@dataclass(frozen=True)
class _Change:
    """What stored amounts changed by over a run, per component."""

    total: Array
    at_events: Array
    moved: Array
    """Sum of the magnitudes of the jumps."""
    largest: Array
    """Largest amount stored."""

    @property
    def smooth(self) -> Array:
        """Change between events."""
        smooth: Array = self.total - self.at_events
        return smooth


def _changes(system: System, values: Values, trajectory: Trajectory, stored: list[ca.SX]) -> list[_Change]:
    t, x, h, b = trajectory.steps.arrays()
    at = trajectory.steps.jumps
    found: list[_Change] = []
    for amounts in _columns(system, "stored", stored)((t.reshape(1, -1), x.T, h.T, b.T), values.p):
        jumps = amounts[:, at] - amounts[:, at - 1]
        total, largest = amounts[:, -1] - amounts[:, 0], np.abs(amounts).max(axis=1)
        found.append(_Change(total, jumps.sum(axis=1), np.abs(jumps).sum(axis=1), largest))
    return found


def _integrals(system: System, values: Values, trajectory: Trajectory, rates: list[ca.SX]) -> list[Array]:
    """Integrals of ``rates`` over the run."""
    function = _columns(system, "rates", rates)
    pieces = trajectory.pieces
    low, high = np.array(pieces.low), np.array(pieces.high)
    h, b = np.array(pieces.h).T, np.array(pieces.b).T
    x = pieces.at_nodes()
    found = [np.zeros(rate.numel()) for rate in rates]
    for node, weight in enumerate(GAUSS_WEIGHTS):
        # relations that compare time read it from frozen bits, so the node's own time serves signals
        t = low + (high - low) * GAUSS_NODES[node]
        now = function((t.reshape(1, -1), x[:, node, :].T, h, b), values.p)
        found = [sum_ + rate @ (weight * (high - low)) for sum_, rate in zip(found, now, strict=True)]
    return found


def _columns(system: System, name: str, columns: list[ca.SX]) -> Columns:
    """The columns as a function, made once; pressures of a net are one symbol: what its ports carry is found once."""

    def made() -> Columns:
        whole = shared(ca.densify(column(columns)), LARGE)
        parts = ca.vertsplit(whole, [0, *np.cumsum([each.numel() for each in columns]).tolist()])
        return Columns(prepare("ledger", system.arguments[:-1], system.p, parts, seldom=True))

    found: Columns = system.once(f"ledger of {name}", made)
    return found


def _errors(names: list[str], missing: Array, passing: Array, change: _Change) -> tuple[dict[str, Number], Number]:
    """Errors per component and of the circuit, as shares of the most that passed through any component."""
    known, stored = passing[np.isfinite(passing)], change.largest[np.isfinite(change.largest)]
    unit = max(float(known.max(initial=0)), AT_REST * float(stored.max(initial=0)), 1e-300)
    return _by_name(names, np.abs(missing) / unit), _number(abs(missing.sum()) / unit)


def _nonzero(names: Iterable[str], numbers: Array) -> dict[str, Number]:
    return {name: number for name, number in _by_name(names, numbers).items() if number != 0}


def _by_name(names: Iterable[str], numbers: Array) -> dict[str, Number]:
    return {name: _number(number) for name, number in zip(names, numbers, strict=True)}


def _number(value: float) -> Number:
    return float(value) if np.isfinite(value) else None
