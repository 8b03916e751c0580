"""Choices on states that make no event and whose branches do not meet: found where a run chatters, told by name.

A plain ``where`` is decided anew at every evaluation. If its branches do not meet, f jumps as a state passes the
boundary; if moreover both branches drive the state back, no step is small enough, and the run would creep for ever.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import casadi as ca
import numpy as np

from crescentlab.symbols import column
from crescentlab.system import System
from crescentlab.walk import Walk, hashes

Array = np.ndarray

ROWS = 200
"""Accepted steps that are looked at, and ..."""
FEWEST = 3
"""... the fewest that tell anything."""
CREEP = 1e5
"""Steps ahead at the present pace beyond which a run creeps; others are not looked at, which takes a while once."""
NEAR = 3.0
"""A run that creeps along a boundary stays within so many of its steps of it."""
ROUNDOFF = 1e-11
"""Choices that move by less, relatively, within a step are at rest."""
UNEVEN = 1e6
"""Ratio of two rates beyond which the smaller is nothing."""
LONGEST = 80
"""Characters of a condition that is quoted."""


class Choices(Walk):
    """The comparisons of states inside f, and f with each of them forced to one side."""

    def __init__(self, system: System) -> None:
        outputs = system.outputs_by_part()
        super().__init__(ca.densify(column([*(y for _, y in outputs), system.f])))
        self.system = system
        owners = [name for name, y in outputs for _ in range(y.numel())]
        owners += [name.rpartition(".")[0] for name in system.state_names]
        states = hashes(system.x)
        sides: dict[int, ca.SX] = {}  # difference of the sides by instruction, positive: 1
        reads: list[list[int]] = []
        moving = set[int]()
        forced: list[ca.SX] = []
        scales: list[ca.SX] = []
        for k, op, parts in self.steps():
            reads += [[] for _ in range(k + 1 - len(reads))]
            reads[k] = parts
            if op == ca.OP_INPUT and self.written[k].element_hash() in states:
                moving.add(k)
            if moving.isdisjoint(parts):
                continue
            moving.add(k)
            values = [self.written[i] for i in parts]
            side, result = _choice(op, values, symbol := ca.SX.sym("s"))
            if side is not None:
                sides[k], self.changed[k] = side, result
                forced.append(symbol)
                scales.append(sum((ca.fabs(value) for value in values), ca.SX(0)))
        self.names = self.described(sides, owners, reads)
        g, f = column(list(sides.values())), self.result()[-system.f.numel() :]
        v = ca.SX.sym("v", system.x.numel())
        rate = ca.jtimes(g, system.x, v) + ca.jacobian(g, system.t) if g.numel() else g
        self.sides = ca.Function("sides", system.arguments, [g, column(scales)])
        self.rates = ca.Function("rates", [*system.arguments, v], [rate])
        self.forced = ca.Function("forced", [*system.arguments, column(forced)], [f])

    def described(self, sides: dict[int, ca.SX], owners: list[str], reads: list[list[int]]) -> list[str]:
        """Each choice in words: the part in whose equations it stands first, and its condition if it is short."""
        owner: dict[int, str] = {}
        for row in sorted(self.rows):
            waiting = [self.rows[row]]
            while waiting:
                k = waiting.pop()
                if k not in owner:
                    owner[k] = owners[row]
                    waiting += reads[k]
        return [f"{owner.get(k, 'f')}{self.text(side)}" for k, side in sides.items()]

    def text(self, side: ca.SX) -> str:
        """The condition with states by their names; empty if it is long."""
        names, text = self.system.state_names, str(side)
        if "@" in text or re.search(r"\b(?:h|b|p|time|stop)_?\d", text):
            return ""
        shown = re.sub(r"\bx_(\d+)\b", lambda m: names[int(m[1])], text)
        shown = re.sub(r"\bx\b", names[0], shown) if len(names) == 1 else shown
        return f": {shown} > 0" if len(shown) < LONGEST else ""


def _choice(op: int, values: list[ca.SX], symbol: ca.SX) -> tuple[ca.SX | None, ca.SX]:
    """Difference of a choice's sides, and its result where ``symbol`` says which side; None for what jumps nowhere."""
    if op in (ca.OP_LT, ca.OP_LE):
        return values[1] - values[0], symbol
    if op == ca.OP_SIGN:
        return values[0], 2 * symbol - 1
    if op in (ca.OP_FLOOR, ca.OP_CEIL):
        nearest = ca.floor(values[0] + 0.5)
        return values[0] - nearest, nearest + symbol - (1 if op == ca.OP_FLOOR else 0)
    return None, symbol


class Chatter:
    """Looks in one run for choices that jump."""

    def __init__(self, system: System, p: Array) -> None:
        self.system, self.p = system, p

    @property
    def choices(self) -> Choices:
        """Those of the system, made once."""
        made: Choices = self.system.once("choices", lambda: Choices(self.system))
        return made

    def look(self, t: Array, x: Array, h: Array, b: Array, left: float | None = None) -> str | None:
        """A sentence if a run creeps along the boundary of a choice both of whose branches push back to it.

        Rows of the run's last steps: times (m,), states (m, n), held values (m, k), bits (m, r). With time ``left`` [s]
        the run must have been at that boundary throughout them, and have a creep ahead; without, it is at its last row.
        """
        if t.size < FEWEST:
            return None
        step = float(t[-1] - t[0]) / (t.size - 1)
        if (left is not None and left < CREEP * step) or not self.choices.names:
            return None
        rows = (t.size - 1,) if left is None else (0, t.size // 2, t.size - 1)
        both = [set(self.pushed_back(float(t[k]), x[k], h[k], b[k], step)) for k in rows]
        for k in set.intersection(*both):
            return (
                f"both sides push towards the boundary of {self.choices.names[k]}, a choice that makes no event and "
                "whose branches do not meet; let them meet, or give it hysteresis (in a circuit a relay, in a class a "
                "held value that `when` switches)"
            )
        return None

    def pushed_back(self, t: float, x: Array, h: Array, b: Array, step: float) -> Iterator[int]:
        """Choices within a few steps of their boundary, both of whose branches drive them back to it."""
        g, scale, f = self.sides(t, x, h, b)
        rate = self.rates(t, x, h, b, f)
        with np.errstate(all="ignore"):
            ahead = -g / rate
        for k in np.flatnonzero(np.abs(ahead) <= NEAR * step).tolist():
            there = t + ahead[k], x + ahead[k] * f
            up, down = (self.rates(*there, h, b, self.sides(*there, h, b, k, side)[2])[k] for side in (1.0, 0.0))
            if up < 0 < down and (down - up) * step > ROUNDOFF * scale[k] and -up / down + -down / up < UNEVEN:
                yield k

    def sides(
        self, t: float, x: Array, h: Array, b: Array, forced: int | None = None, side: float = 0.0
    ) -> tuple[Array, Array, Array]:
        """Differences of the choices' sides, their magnitudes, and f with one of them forced to a side."""
        g, scale = (np.array(v).ravel() for v in self.choices.sides(t, x, h, b, self.p))
        sides = (g > 0).astype(float)
        if forced is not None:
            sides[forced] = side
        return g, scale, np.array(self.choices.forced(t, x, h, b, self.p, sides)).ravel()

    def rates(self, t: float, x: Array, h: Array, b: Array, f: Array) -> Array:
        """Rates of the differences along f."""
        return np.array(self.choices.rates(t, x, h, b, self.p, f)).ravel()
