"""Where a run stands, whole: what another run needs to go on from there as if it had never ended."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from crescentlab.errors import InputError, nearest
from crescentlab.system import System, Values

Array = np.ndarray


@dataclass(frozen=True)
class Snapshot:
    """Time, states (n,), held values (k,), bits (r,), conditions that hold (c,), and the clocks of the ticks.

    The conditions matter because an event fires when its condition turns true, not while it is; the bits because a
    relation on its boundary keeps its side. Tick k of a clock falls on ``origin + k * period``; ``ticked`` have passed.
    Clocks: each (clocks,).
    """

    t: float
    x: Array
    h: Array
    b: Array
    holds: Array
    origin: Array
    ticked: Array
    period: Array

    def values(self, values: Values) -> Values:
        """The numbers of a run that begins here."""
        return replace(values, x0=self.x, h0=self.h)

    def clocks(self, period: Array, tolerance: float) -> tuple[Array, Array]:
        """Origins and counts for clocks that now have these periods: as they were, or going on from their last tick."""
        last = self.origin + self.ticked * self.period
        changed = np.abs(period - self.period) > 1e-13 * self.period
        late = last + period < self.t - tolerance
        origin = np.where(changed, np.where(late, self.t, last), self.origin)
        return origin, np.where(changed, 0, self.ticked)

    def as_text(self, system: System) -> str:
        """JSON by names, exact to the last bit."""
        rising, ticking = _conditions(system), _ticks(system)
        return json.dumps({
            "t": self.t,
            "states": dict(zip(system.state_names, self.x.tolist(), strict=True)),
            "held": dict(zip(system.held_names, self.h.tolist(), strict=True)),
            "bits": list(zip(system.bits.names, self.b.astype(int).tolist(), strict=True)),
            "holds": list(zip(rising, self.holds.astype(int).tolist(), strict=True)),
            "clocks": dict(zip(ticking, np.transpose([self.origin, self.ticked, self.period]).tolist(), strict=True)),
        })  # fmt: skip

    @staticmethod
    def of_text(text: str, system: System, source: str) -> Snapshot:
        """Read :meth:`as_text` for a system of the same states; raises :class:`InputError` naming what does not fit.

        Bits and conditions of relations that the system does not have in the same order are settled anew.
        """
        try:
            found: dict[str, Any] = json.loads(text)
            states, held, clocks = found["states"], found["held"], found["clocks"]
            bits, holds = _values(found["bits"], system.bits.names), _values(found["holds"], _conditions(system))
            t = float(found["t"])
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{source}: it does not say where its run ended; simulate the circuit anew") from None
        origin, ticked, period = _by_name(clocks, _ticks(system), source).reshape(-1, 3).T
        return Snapshot(
            t, _by_name(states, system.state_names, source), _by_name(held, system.held_names, source),
            np.zeros(len(system.bits.names)) if bits is None else bits,
            np.zeros(len(_conditions(system))) if holds is None else holds,
            origin, ticked.astype(np.int64), period,
        )  # fmt: skip


def _conditions(system: System) -> list[str]:
    return [event.name for event in system.events if event.kind != "every"]


def _ticks(system: System) -> list[str]:
    return [event.name for event in system.events if event.kind == "every"]


def _by_name(found: dict[str, Any], names: list[str], source: str) -> Array:
    for name in names:
        if name not in found:
            near = f": {nearest(name, found)}" if found else ""
            raise InputError(f"{source}: its run had no {name}{near}; a start must come from a circuit of equal parts")
    for name in found:
        if name not in names:
            raise InputError(f"{source}: its run had {name}, which this circuit does not; give it the same --set")
    return np.array([found[name] for name in names], dtype=float)


def _values(pairs: list[list[Any]], names: list[str] | tuple[str, ...]) -> Array | None:
    return np.array([float(v) for _, v in pairs]) if [n for n, _ in pairs] == list(names) else None
