"""What of the assembled equations depends on time alone: conditions that become exact stops, values that set the pace.

An integrator that steps over a pulse never sees it. So a comparison whose sides depend on time and parameters alone, or
on held values and a straight line in time, becomes a relation wherever it is written, ``where(t > 1 s, ...)`` in a
formula behind three signals included: its instant is known ahead, and no step passes it. What jumps (a comparison,
``sign``, ``floor``) reads its frozen bit; what only bends (``min``, ``max``, ``abs``) makes a stop at its kink.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

from crescentlab.symbols import column
from crescentlab.walk import Walk, hashes

COMPARISONS = {ca.OP_LT: True, ca.OP_LE: False}
"""Operations a < b and a <= b, and whether they are strict."""
KINKS = {ca.OP_FMIN, ca.OP_FMAX, ca.OP_FABS}
WHOLE = {ca.OP_FLOOR, ca.OP_CEIL, ca.OP_FMOD, ca.OP_REMAINDER}
NAME = "a condition on time alone"


@dataclass
class TimeAlone:
    """An expression with bits in place of its conditions on time, and what those bits mean."""

    expression: ca.SX
    bits: list[ca.SX] = field(default_factory=list)
    relations: list[ca.SX] = field(default_factory=list)
    """Difference of the sides; positive: the bit is 1."""
    scales: list[ca.SX] = field(default_factory=list)
    strict: list[bool] = field(default_factory=list)
    straight: list[bool] = field(default_factory=list)
    """Whether the difference is a straight line in time between stops."""
    clock: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    """Values that curve in time and depend on nothing else but parameters, as they were written."""


def time_alone(value: ca.SX, t: ca.SX, x: ca.SX, fixed: ca.SX, paced: int) -> TimeAlone:
    """Take the conditions on time out of a dense column; x are the states, ``fixed`` held values and bits.

    The first ``paced`` rows set the pace if they are on time alone; the others are conditions, foreseen anyway.
    """
    if t.element_hash() not in hashes(value):
        return TimeAlone(value)
    return _Conditions(value, t, x, fixed).done(paced)


class _Conditions(Walk):
    """One pass over the instructions of an expression, each marked by what it depends on."""

    def __init__(self, value: ca.SX, t: ca.SX, x: ca.SX, fixed: ca.SX) -> None:
        super().__init__(value)
        self.t = t
        self.states, self.fixed = hashes(x), hashes(fixed)
        self.outcome = TimeAlone(value)
        self.met: dict[tuple[int, ...], ca.SX] = {}
        self.straight = True
        """Whether what the present instruction reads are straight lines in time between stops."""
        self.degree: dict[int, int] = {}
        """In t between stops: 0 constant, 1 a straight line, 2 any curve."""

    def done(self, paced: int) -> TimeAlone:
        timed, moving, held = set[int](), set[int](), set[int]()
        alone: dict[int, ca.SX] = {}  # the largest values on time and parameters alone
        for k, op, parts in self.steps():
            if op == ca.OP_INPUT:
                symbol = self.written[k].element_hash()
                for marks, symbols in ((timed, {self.t.element_hash()}), (moving, self.states), (held, self.fixed)):
                    if symbol in symbols:
                        marks.add(k)
                self.degree[k] = int(k in timed)
                continue
            for marks in (timed, moving, held):
                if not marks.isdisjoint(parts):
                    marks.add(k)
            if k in moving or k in held:
                alone |= {i: self.written[i] for i in parts if i in timed and i not in moving and i not in held}
            if k in timed:
                self.degree[k] = self.degree_of(op, [self.degree.get(i, 0) for i in parts])
                self.straight = all(self.degree.get(i, 0) < 2 for i in parts)
                if k not in moving and (k not in held or (self.straight and op not in WHOLE)):
                    self.visit(k, op, parts)
        ends = {i for row, i in self.rows.items() if row < paced}
        alone |= {i: self.written[i] for i in ends if i in timed and i not in moving and i not in held}
        self.outcome.clock = self.curved(column(list(alone.values())))
        self.outcome.expression = self.result()
        return self.outcome

    @staticmethod
    def degree_of(op: int, degrees: list[int]) -> int:
        """Degree of a result; a choice is constant between stops."""
        if op in COMPARISONS or op in (ca.OP_NOT, ca.OP_AND, ca.OP_OR):
            return 0
        if op in (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_ASSIGN, *KINKS):
            return max(degrees)
        if op == ca.OP_MUL or op == ca.OP_IF_ELSE_ZERO:
            return min(sum(degrees), 2)
        if op == ca.OP_DIV and not degrees[1]:
            return degrees[0]
        return 2 if any(degrees) else 0

    def visit(self, k: int, op: int, parts: list[int]) -> None:
        """Give instruction k, on time, its bit if it is a condition."""
        if op in COMPARISONS:
            low, high = (self.now(i) for i in parts)
            self.changed[k] = self.bit(high - low, COMPARISONS[op], (op, *parts))
        elif op in KINKS:
            first, second = (values := [self.now(i) for i in parts])[0], -values[0] if len(values) == 1 else values[1]
            more = self.bit(first - second if len(values) == 2 else first, True, (op, *parts))
            if self.straight:  # of a curve a root may be missed; the operation itself is right on either side
                self.changed[k] = (
                    ca.if_else(more, second, first) if op == ca.OP_FMIN else ca.if_else(more, first, second)
                )
        elif op == ca.OP_SIGN:
            value = self.now(parts[0])
            self.changed[k] = self.bit(value, True, (op, parts[0], 1)) - self.bit(-value, True, (op, parts[0], -1))
        elif op in WHOLE:
            self.changed[k] = self.whole(op, parts)

    def whole(self, op: int, parts: list[int]) -> ca.SX:
        """Whole parts of values on time: they jump at every whole number, and are frozen between."""
        values = [self.now(i) for i in parts]
        if op == ca.OP_FLOOR:
            return self.floor(values[0], (op, parts[0], 0))
        if op == ca.OP_CEIL:
            return -self.floor(-values[0], (op, parts[0], 0))
        quotient = values[0] / values[1]
        if op == ca.OP_REMAINDER:  # to the nearest whole number
            return values[0] - values[1] * self.floor(quotient + 0.5, (op, *parts))
        up = self.bit(quotient, False, (-op, *parts))
        rising, falling = self.floor(quotient, (op, *parts)), -self.floor(-quotient, (op, parts[1], parts[0]))
        return values[0] - values[1] * ca.if_else(up, rising, falling)

    def floor(self, value: ca.SX, key: tuple[int, ...]) -> ca.SX:
        """floor(value), its parity frozen: half a unit beyond both ends of a piece it still gives that piece."""
        even = self.bit(ca.sin(ca.pi * value), False, key)
        return ca.if_else(even, 2 * ca.floor((value + 0.5) / 2), 2 * ca.floor((value - 0.5) / 2) + 1)

    def bit(self, difference: ca.SX, strict: bool, key: tuple[int, ...]) -> ca.SX:
        """The bit that says whether a difference on time is positive."""
        if key not in self.met:
            self.met[key] = ca.SX.sym(f"time{len(self.met)}")
            self.outcome.bits.append(self.met[key])
            self.outcome.relations.append(difference)
            parts = [difference.dep(i) for i in range(difference.n_dep())] or [difference]
            self.outcome.scales.append(sum((ca.fabs(part) for part in parts), ca.SX(0)))
            self.outcome.strict.append(strict)
            self.outcome.straight.append(self.straight and difference.op() != ca.OP_SIN)
        return self.met[key]

    def curved(self, alone: ca.SX) -> ca.SX:
        """Those of the values on time alone that are no straight lines, which swing never."""
        bent = ca.which_depends(alone, self.t, 2, True) if alone.numel() else []
        return column([alone[k] for k, is_bent in enumerate(bent) if is_bent])
