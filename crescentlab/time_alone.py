"""What of the assembled equations depends on time alone: conditions that become exact stops, values that set the pace.

An integrator that steps over a pulse never sees it. So a comparison whose sides depend on time, parameters and held
values but on no state becomes a relation wherever it is written, ``where(t > 1 s, ...)`` in a formula behind three
signals included: its instant is known ahead, and no step passes it. What jumps (a comparison, ``sign``, ``floor``)
reads its frozen bit; what only bends (``min``, ``max``, ``abs``) stays as it is and makes a stop at its kink.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

from crescentlab.symbols import column

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
    clock: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    """Values that curve in time and depend on nothing else but parameters, as they were written."""


def time_alone(value: ca.SX, t: ca.SX, x: ca.SX, fixed: ca.SX) -> TimeAlone:
    """Take the conditions on time out of a dense column; x are the states, ``fixed`` held values and bits."""
    free = list(ca.symvar(value))
    if not any(s.element_hash() == t.element_hash() for s in free):
        return TimeAlone(value)
    return _Walk(value, free, t, x, fixed).done()


class _Walk:
    """One pass over the instructions of an expression, each marked by what it depends on."""

    def __init__(self, value: ca.SX, free: list[ca.SX], t: ca.SX, x: ca.SX, fixed: ca.SX) -> None:
        self.t, self.size = t, value.numel()
        self.function = ca.Function("walk", free, [value])
        self.written = ca.vertsplit(self.function.instructions_sx())
        for k in range(self.function.n_instructions()):
            if self.function.instruction_id(k) == ca.OP_INPUT:  # CasADi leaves these out
                self.written[k] = free[self.function.instruction_input(k)[0]]
        self.changed: dict[int, ca.SX] = {}
        """Instructions whose expression has bits in it."""
        self.result = TimeAlone(value)
        self.met: dict[tuple[int, ...], ca.SX] = {}
        states, others = ({s.element_hash() for s in ca.symvar(v)} for v in (x, fixed))
        hashes = [s.element_hash() for s in free]
        self.timed = [h == t.element_hash() for h in hashes]
        self.moving = [h in states for h in hashes]
        self.held = [h in others for h in hashes]

    def now(self, k: int) -> ca.SX:
        """The expression of instruction k, with bits where it has any."""
        return self.changed[k] if k in self.changed else self.written[k]

    def done(self) -> TimeAlone:
        walk, count = self.function, self.function.n_instructions()
        source: dict[int, int] = {}  # instruction that wrote each place of the work vector
        timed, moving, held = [False] * count, [False] * count, [False] * count
        rows: dict[int, ca.SX] = {}
        alone: dict[int, ca.SX] = {}
        for k in range(count):
            op, ins, outs = walk.instruction_id(k), walk.instruction_input(k), walk.instruction_output(k)
            if op == ca.OP_INPUT:
                timed[k], moving[k], held[k] = self.timed[ins[0]], self.moving[ins[0]], self.held[ins[0]]
                source[outs[0]] = k
            elif op == ca.OP_CONST:
                source[outs[0]] = k
            else:
                parts = [source[i] for i in ins]
                timed[k] = any(timed[i] for i in parts)
                moving[k], held[k] = any(moving[i] for i in parts), any(held[i] for i in parts)
                if op == ca.OP_OUTPUT or moving[k] or held[k]:
                    alone |= {i: self.written[i] for i in parts if timed[i] and not (moving[i] or held[i])}
                if op == ca.OP_OUTPUT:
                    if parts[0] in self.changed:
                        rows[outs[1]] = self.changed[parts[0]]
                    continue
                source[outs[0]] = k
                self.visit(k, op, parts, timed[k] and not moving[k])
        self.result.clock = self.curved(column(list(alone.values())))
        if rows:
            expression = ca.SX(self.result.expression)
            for row, new in rows.items():
                expression[row] = new
            self.result.expression = expression
        return self.result

    def visit(self, k: int, op: int, parts: list[int], on_time: bool) -> None:
        """Give instruction k its bit if it is a condition on time, or the changed values that it works on."""
        if on_time and op in COMPARISONS:
            low, high = (self.now(i) for i in parts)
            self.changed[k] = self.bit(high - low, COMPARISONS[op], (op, *parts))
        elif on_time and op in KINKS:
            values = [self.now(i) for i in parts]
            self.bit(values[-1] - values[0] if len(values) == 2 else values[0], True, (op, *parts, -1)[:3])
            self.again(k, op, parts)
        elif on_time and op == ca.OP_SIGN:
            value = self.now(parts[0])
            self.changed[k] = self.bit(value, True, (op, parts[0], 1)) - self.bit(-value, True, (op, parts[0], -1))
        elif on_time and op in WHOLE:
            self.changed[k] = self.whole(op, parts)
        else:
            self.again(k, op, parts)

    def again(self, k: int, op: int, parts: list[int]) -> None:
        """The operation on changed values, where any has changed."""
        if any(i in self.changed for i in parts):
            values = [self.now(i) for i in parts]
            self.changed[k] = ca.SX.unary(op, *values) if len(values) == 1 else ca.SX.binary(op, *values)

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
            self.result.bits.append(self.met[key])
            self.result.relations.append(difference)
            parts = [difference.dep(i) for i in range(difference.n_dep())] or [difference]
            self.result.scales.append(sum((ca.fabs(part) for part in parts), ca.SX(0)))
            self.result.strict.append(strict)
        return self.met[key]

    def curved(self, alone: ca.SX) -> ca.SX:
        """Those of the values on time alone that are no straight lines, which swing never."""
        bent = ca.which_depends(alone, self.t, 2, True) if alone.numel() else []
        return column([alone[k] for k, is_bent in enumerate(bent) if is_bent])
