"""An expression taken apart: its instructions in order, and the same expression with some of them replaced."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca


class Walk:
    """The instructions of a dense column; what is put into ``changed`` takes the place of an instruction's result."""

    def __init__(self, value: ca.SX) -> None:
        self.value = value
        self.free: list[ca.SX] = list(ca.symvar(value))
        self.function = ca.Function("walk", self.free, [value])
        self.written: list[ca.SX] = ca.vertsplit(self.function.instructions_sx())
        """The result of each instruction as it stands."""
        for k in range(self.function.n_instructions()):
            if self.function.instruction_id(k) == ca.OP_INPUT:  # CasADi leaves these out
                self.written[k] = self.free[self.function.instruction_input(k)[0]]
        self.changed: dict[int, ca.SX] = {}
        self.rows: dict[int, int] = {}
        """The instruction whose result each row of the column is."""

    def steps(self) -> Iterator[tuple[int, int, list[int]]]:
        """Each instruction but the outputs: its number, its operation, the numbers of those whose results it reads.

        One that reads what was changed before is changed with it, unless the caller has given it a result of its own.
        """
        walk, source = self.function, dict[int, int]()  # instruction that wrote each place of the work vector
        for k in range(walk.n_instructions()):
            op, ins, outs = walk.instruction_id(k), walk.instruction_input(k), walk.instruction_output(k)
            if op == ca.OP_OUTPUT:
                self.rows[outs[1]] = source[ins[0]]
                continue
            parts = [] if op in (ca.OP_INPUT, ca.OP_CONST) else [source[i] for i in ins]
            source[outs[0]] = k
            yield k, op, parts
            if k not in self.changed and any(i in self.changed for i in parts):
                values = [self.now(i) for i in parts]
                self.changed[k] = ca.SX.unary(op, *values) if len(values) == 1 else ca.SX.binary(op, *values)

    def now(self, k: int) -> ca.SX:
        """The result of instruction k, changed or as it stands."""
        return self.changed[k] if k in self.changed else self.written[k]

    def result(self) -> ca.SX:
        """The column with all changes in it."""
        expression = ca.SX(self.value)
        for row, k in self.rows.items():
            if k in self.changed:
                expression[row] = self.changed[k]
        return expression


def hashes(symbols: ca.SX) -> set[int]:
    """What tells symbols apart, whatever their names."""
    return {s.element_hash() for s in ca.symvar(symbols)}
