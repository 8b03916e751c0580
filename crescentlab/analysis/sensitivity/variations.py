"""Exact first derivatives of a circuit's equations along its runs, as CasADi functions of the expression graph."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np

from crescentlab.analysis.sensitivity.replay import World
from crescentlab.prepared import Evaluator, Prepared, jacobian, prepare
from crescentlab.solvers.hybrid import Round
from crescentlab.symbols import column
from crescentlab.system import System, Values

Array = np.ndarray


class Variations:
    """Derivatives at given times, states, held values and bits, along directions dp (np, m) of the parameters."""

    def __init__(self, system: System, values: Values, dp: Array) -> None:
        self.system, self.p, self.dp = system, values.p, dp
        self.n, self.m = system.x.numel(), dp.shape[1]
        of_x, of_h = system.jacobian_expression.sparsity(), _held_jacobian(system).sparsity()
        self.places = _places(of_x)
        rows, columns = _places(of_h)
        self.used = np.unique(columns)
        """Held values that f depends on."""
        self.held_places = rows, np.searchsorted(self.used, columns)
        directions = dp if np.any(dp) else dp[:, :0]
        self.forced = directions.shape[1]
        made = system.once(f"along {self.forced}", lambda: _along(system, self.forced))
        self.derivatives = Evaluator(made, np.concatenate([values.p, directions.ravel(order="F")]))
        self.rate = Evaluator(system.rhs, values.p)
        self.numbers = max(1, self.places[0].size + self.n * (self.used.size + self.m))
        """Numbers of derivatives at one time."""
        self.ticking = [k for k, event in enumerate(system.events) if event.kind == "every"]
        self.dperiod = self.periods()

    # -- between stops ---------------------------------------------------------------------------

    def along(self, t: Array, x: Array, h: Array, b: Array) -> tuple[Array, Array, Array]:
        """Nonzeros of df/dx (times, j), df/dh of the held values used (times, n, used), df/dp dp (times, n, m)."""
        of_x = np.zeros((t.size, self.places[0].size))
        of_h = np.zeros((t.size, self.n, self.used.size))
        forcing = np.zeros((t.size, self.n, self.m))
        for k in range(t.size if self.n else 0):
            nonzeros, held, forced = self.derivatives(float(t[k]), x[k], h[k], b[k])
            of_x[k] = nonzeros
            of_h[k][self.held_places] = held
            if self.forced:
                forcing[k] = forced.reshape(self.m, self.n).T
        return of_x, of_h, forcing

    # -- at stops --------------------------------------------------------------------------------

    def f(self, t: float, world: World) -> Array:
        """dx/dt, shape (n,)."""
        return self.rate(t, world.x, world.h, world.b)[0].copy()

    def differ(self, t: float, one: World, other: World) -> bool:
        """Whether dx/dt or the conditions of events are others in another world."""
        condition = self.function("conditions", lambda s: ca.Function("c", s.arguments, [ca.densify(s.conditions)]))
        seen = [condition(t, w.x, w.h, w.b, self.p).full() for w in (one, other)]
        return not (np.array_equal(self.f(t, one), self.f(t, other)) and np.array_equal(*seen))

    def value(self, t: float, world: World) -> Array:
        """The relations, shape (r,)."""
        function = self.function("relations", lambda s: ca.Function("g", s.arguments, [ca.densify(s.relations)]))
        found: Array = function(t, world.x, world.h, world.b, self.p).full().ravel()
        return found

    def scales(self, t: float, world: World) -> Array:
        """Magnitude of both sides of each relation."""
        function = self.function("scales", lambda s: ca.Function("scales", s.arguments, [ca.densify(s.scales)]))
        found: Array = function(t, world.x, world.h, world.b, self.p).full().ravel()
        return found

    def relations(self, t: float, world: World, dt: float, dx: Array, dh: Array, along_p: float) -> Array:
        """How the relations change along (dt, dx (n, j), dh (k, j), along_p dp): shape (r, j)."""
        function = self.function("relations along", _relations_along)
        dp = along_p * self.dp if along_p else np.zeros((self.p.size, 1))
        found: Array = function(t, world.x, world.h, world.b, self.p, dt, dx, dh, dp).full()
        return found

    def remap(self, t: float, each: Round, dt: Array, dx: Array, dh: Array) -> tuple[Array, Array]:
        """How what a round sets changes along (dt (m,), dx (n, m), dh (k, m), dp)."""
        kind = "all" if each.ticks and each.events else "ticks" if each.ticks else "events"
        function = self.function(f"remap along {kind}", lambda system: _remap_along(system, kind))
        x, h = function(t, each.x, each.h, each.b, each.flags, self.p, dt.reshape(1, -1), dx, dh, self.dp)
        return x.full(), h.full()

    def tick(self, position: int, count: int) -> Array:
        """How far a tick moves, shape (m,) [s]."""
        moved: Array = count * self.dperiod[position]
        return moved

    def periods(self) -> Array:
        """Derivatives of the ticks' periods, shape (ticks, m)."""
        if not self.ticking:
            return np.zeros((0, self.m))
        function = self.function("periods along", _periods_along)
        found: Array = function(self.p, self.dp).full()
        return found

    def function(self, name: str, make: Callable[[System], ca.Function]) -> ca.Function:
        """A function of the structure alone, made once."""
        made: ca.Function = self.system.once(name, lambda: make(self.system))
        return made


def _held_jacobian(system: System) -> ca.SX:
    made: ca.SX = system.once("dfdh", lambda: jacobian(system.f, system.h))
    return made


def _places(sparsity: ca.Sparsity) -> tuple[Array, Array]:
    """Rows and columns of the nonzeros."""
    rows, columns = sparsity.get_triplet()
    return np.array(rows, dtype=int), np.array(columns, dtype=int)


def _along(system: System, m: int) -> Prepared:
    """Nonzeros of df/dx and df/dh, and df/dp dp (n m), with the m directions dp after the parameters."""
    directions = ca.SX.sym("dp", system.p.numel(), m)
    change = ca.jtimes(system.f, system.p, directions) if m else ca.SX(0, 1)
    outputs = [system.jacobian_expression.nz[:], _held_jacobian(system).nz[:], ca.vec(ca.densify(change))]
    return prepare("along", system.arguments[:-1], column([system.p, ca.vec(directions)]), outputs, seldom=True)


def _like(name: str, symbol: ca.SX) -> ca.SX:
    return ca.SX.sym(name, symbol.numel())


def _directions(system: System) -> tuple[ca.SX, list[ca.SX]]:
    """t, x, h, p as one column, and a direction of each."""
    symbols = [system.t, system.x, system.h, system.p]
    return ca.vertcat(*symbols), [_like(f"d{k}", symbol) for k, symbol in enumerate(symbols)]


def _relations_along(system: System) -> ca.Function:
    symbols, directions = _directions(system)
    change = ca.densify(ca.jtimes(system.relations, symbols, ca.vertcat(*directions)))
    return ca.Function("relations_along", [*system.arguments, *directions], [change])


def _remap_along(system: System, kind: str) -> ca.Function:
    may_fire = [kind == "all" or (event.kind == "every") == (kind == "ticks") for event in system.events]
    fired, after = system.remapping(may_fire)
    symbols, directions = _directions(system)
    changes = [ca.densify(ca.jtimes(each, symbols, ca.vertcat(*directions))) for each in after]
    return ca.Function("remap_along", [*system.arguments[:-1], fired, system.p, *directions], changes)


def _periods_along(system: System) -> ca.Function:
    direction = _like("dp", system.p)
    change = ca.densify(ca.jtimes(ca.densify(system.periods), system.p, direction))
    return ca.Function("periods_along", [system.p, direction], [change])
