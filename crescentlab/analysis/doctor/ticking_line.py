r"""Two-port of a line that steps by ticks, by its own equations: the sampled response to a continuous sine.

Of a line whose states only count what its ends take in, the variation over a tick of T [s] is

.. math:: \delta x(T) = \delta x + \int_0^T \left(f_h\,\delta h + f_u\,u e^{j\omega\tau}\right) d\tau, \qquad
          e^{j\omega T} \begin{pmatrix} \delta x \\ \delta h \end{pmatrix}
          = R_x\,\delta x(T) + R_h\,\delta h + R_u\,u e^{j\omega T}

h the held values, u what the ends receive (pressure [Pa] or flow [m^3/s] into the line), R the tick. What the ends give
is read just after a tick. Integrals by Gauss's rule. Above a quarter of the tick rate, four ticks per wave, no scheme
of nodes says anything of a wave, and the images that the ticks make of it are as strong: such frequencies are left out.
Source: K. J. Astrom, B. Wittenmark, Computer-Controlled Systems (1997), chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from crescentlab import units
from crescentlab.analysis.linear.model import shifted_solver
from crescentlab.component import Component
from crescentlab.domain import Held, State
from crescentlab.fluid import Fluid
from crescentlab.trace import Trace, numeric_fields

Array = np.ndarray

SAMPLES_PER_WAVE = 4
"""Ticks per period of a wave from which a line is judged."""
NODES, WEIGHTS = (0.5 * each for each in np.polynomial.legendre.leggauss(6) + np.array([[1.0], [0.0]]))
"""Gauss's nodes and weights on 0 to 1."""
NEWTON, CLOSE, NEAR = 30, 1e-9, 1e-5
"""Most steps to rest, the part of the usual sizes below which a step is the last, and with which rounding may go on."""
OPEN = 1e-10
"""Slopes below this part of the steepest leave a value open: a closed line's pressure."""
SPARSE_FROM, SURE = 60, 1e-12
"""Unknowns from which a sparse solution is tried, and the least pivot over the largest at which it is taken."""
SMALL, SLOW, LAG = 1e-4, 0.01, 0.6 * np.exp(0.5j)
"""Where branches of a law meet at rest (a limiter of fronts), those of a small slow sine are taken: its part of the
usual size, its phase per tick [rad], and what the second end receives over the first."""


@dataclass(frozen=True)
class Slopes:
    """Derivatives about a point: of the rates at Gauss's nodes, of the tick R, of what the ends give y."""

    period: float
    scale: Array
    """Usual sizes of states and held values (z,)."""
    f_h: Array
    f_u: Array
    """Shapes (nodes, states, held) and (nodes, states, inputs)."""
    R_x: Array
    R_h: Array
    R_u: Array
    """Shapes (z, states), (z, held) and (z, inputs)."""
    y_h: Array
    y_u: Array

    @property
    def over_a_tick(self) -> Array:
        """Integral of f_h, shape (states, held)."""
        return np.asarray(self.period * np.tensordot(WEIGHTS, self.f_h, axes=1))

    def motion(self, omega: Array) -> Array:
        """States and held values just after a tick per input e^{j omega t}, shape (m, z, inputs)."""
        turn = np.exp(1j * np.outer(omega * self.period, NODES)) * WEIGHTS * self.period
        taken = np.einsum("mk,kiu->miu", turn, self.f_u)
        own = np.hstack([self.R_x, self.R_x @ self.over_a_tick + self.R_h])
        solve = shifted_solver(own * self.scale / self.scale[:, None])
        drive = self.R_x @ taken + self.R_u * np.exp(1j * omega * self.period)[:, None, None]
        found = [
            solve(np.exp(1j * w * self.period), d / self.scale[:, None]) for w, d in zip(omega, drive, strict=True)
        ]
        return np.asarray(self.scale[:, None] * np.stack(found))

    def response(self, omega: Array) -> Array:
        """What the ends give just after a tick per what they receive, shape (m, outputs, inputs)."""
        return np.asarray(self.y_h @ self.motion(omega)[:, self.f_h.shape[1] :] + self.y_u)


class TickingLine:
    """Equations of a line whose states only count, as functions of time since the tick; :meth:`slopes` of them."""

    def __init__(self, form: Component, fluid: Fluid, traced: Trace) -> None:
        self.form, self.traced = form, traced
        self.nx, self.nh = traced.states.size, traced.held.size
        (tick,) = [event for event in traced.events if event.kind == "every"]
        p, pf = _parameters(form, fluid, traced)
        t, x, h, u = (
            ca.SX.sym("t"),
            ca.SX.sym("x", self.nx),
            ca.SX.sym("h", self.nh),
            ca.SX.sym("u", traced.inputs.size),
        )
        b = ca.SX.sym("b", int(traced.relation.size1_out(0)) if traced.relations else 0)
        given = (t, x, h, b, u, p, pf)
        y = ca.SX.zeros(traced.outputs.size)
        for group in traced.groups:
            y[list(group.outputs)] = group.function(*given)
        rate = traced.derivative(*given)
        assert tick.remap is not None
        after = tick.remap(*given)
        of = [t, x, h, u, b]
        self.relation = ca.Function("relation", of, [ca.densify(traced.relation(*given))])
        self.bits = b.numel()
        self.rates = ca.Function("rates", of, [ca.densify(e) for e in (rate, *_by(rate, h, u))])
        self.gives = ca.Function("gives", of, [ca.densify(e) for e in _by(y, h, u)])
        self.after = ca.Function("after", of, [ca.densify(e) for e in (after, *_by(after, x, h, u))])
        self.counts_alone = not any(ca.which_depends(ca.vertcat(rate, y), x, 1, False))
        (self.period,) = periods_of(form, fluid, traced).tolist()
        self.scale = np.array([n for kind in (State, Held) for _, n, _ in self._declared(kind)])
        self.counting = np.array([c for _, _, c in self._declared(Held)], bool)

    def _declared(self, kind: type[State] | type[Held]) -> list[tuple[units.Quantity, float, bool]]:
        """Quantity, usual size and whether it counts, element by element."""
        found: list[tuple[units.Quantity, float, bool]] = []
        layout = self.traced.states if kind is State else self.traced.held
        for declared in type(self.form).declared(kind):
            quantity = self.form.quantity(declared.quantity)
            nominal = (declared.nominal if isinstance(declared, State) else None) or quantity.nominal
            found += [(quantity, nominal, declared.counts)] * len(layout.indices(declared.name))
        return found

    def _at(self, function: ca.Function, t: float, x: Array, h: Array, u: Array) -> list[Array]:
        bits = np.zeros(self.bits)
        if self.bits:
            bits = (np.array(self.relation(t, x, h, u, bits))[:, 0] > 0).astype(float)
        return [np.array(m) for m in function.call([t, x, h, u, bits])]

    def slopes(self, x: Array, h: Array, u: Callable[[float], Array]) -> tuple[Slopes, Array]:
        """Derivatives over a tick from x and h with the ends receiving u(t), and h after it."""
        every = [self._at(self.rates, s * self.period, x, h, u(s * self.period)) for s in NODES]
        f, f_h, f_u = (np.stack(each) for each in zip(*every, strict=True))
        end = x + self.period * (WEIGHTS @ f[:, :, 0])
        after, R_x, R_h, R_u = self._at(self.after, self.period, end, h, u(self.period))
        y_h, y_u = self._at(self.gives, 0.0, x, h, u(0.0))
        return Slopes(self.period, self.scale, f_h, f_u, R_x, R_h, R_u, y_h, y_u), after[self.nx :, 0]

    def at_rest(self, p: float, q: float, u: Array) -> Array:
        """Held values that a tick leaves as they are; what rest leaves open stays at p [Pa] and q [m^3/s].

        Raises :class:`numpy.linalg.LinAlgError` where none are found.
        """
        mean = {units.pressure: p, units.pressure_difference: p, units.flow: q}
        h = np.array([0.0 if c else mean.get(k, 0.0) for k, _, c in self._declared(Held)])
        free, scale = np.flatnonzero(~self.counting), self.scale[self.nx :][~self.counting]
        for _ in range(NEWTON):
            found, after = self.slopes(np.zeros(self.nx), h, lambda _: u)
            by_h = (found.R_x @ found.over_a_tick + found.R_h)[self.nx :] - np.eye(self.nh)
            slope = by_h[np.ix_(free, free)] * scale / scale[:, None]
            step = scale * smallest_step(slope, (h - after)[free] / scale, OPEN)
            h[free] += step
            if np.all(np.abs(step) <= CLOSE * scale):
                return h
        if not np.all(np.abs(step) <= NEAR * scale):
            raise np.linalg.LinAlgError("no rest")
        return h

    def response(self, omega: Array, p: float, q: float, means: dict[str, float]) -> Array:
        """What the ends give per what they receive at omega [rad/s], shape (m, outputs, inputs).

        About rest at p [Pa], q [m^3/s] and what each end receives in the mean, ``means``.
        """
        names = [name for name, _ in self.traced.inputs.slots]
        rest = np.array([means[name] for name in names])
        h = self.at_rest(p, q, rest)
        found, _ = self.slopes(np.zeros(self.nx), h, lambda _: rest)
        sizes = np.array([units.pressure.nominal if n.startswith("p_") else units.flow.nominal for n in names])
        sine, slow = SMALL * sizes * np.array([1.0, LAG]), SLOW / self.period
        for _ in range(2):
            z = (found.motion(np.array([slow]))[0] @ sine).real
            found, _ = self.slopes(z[: self.nx], h + z[self.nx :], lambda t: rest + (sine * np.exp(1j * slow * t)).real)
        return found.response(omega)


def smallest_step(slope: Array, right: Array, least: float) -> Array:
    """The smallest x (n,) with slope x = right; what slopes below ``least`` of the steepest leave open does not move.

    Many unknowns, of which each meets few others, are solved as a sparse system if none is open. Raises
    :class:`numpy.linalg.LinAlgError` for what is not finite.
    """
    if not (np.isfinite(slope).all() and np.isfinite(right).all()):
        raise np.linalg.LinAlgError("not finite")
    if len(slope) >= SPARSE_FROM:
        try:
            factors = splu(csc_array(slope))
        except RuntimeError:  # exactly singular
            pass
        else:
            pivots = np.abs(factors.U.diagonal())
            if pivots.min() > SURE * pivots.max():
                return np.asarray(factors.solve(right))
    return np.asarray(np.linalg.lstsq(slope, right, rcond=least)[0])


def _parameters(form: Component, fluid: Fluid, traced: Trace) -> tuple[list[float], list[float]]:
    """Numbers of the line and of its fluid, as its functions take them."""
    own = [float(getattr(form, n)) for n in traced.parameters]
    return own, [float(getattr(fluid, n)) for n in numeric_fields(type(fluid), fluid)] if traced.fluids else []


def periods_of(form: Component, fluid: Fluid, traced: Trace) -> Array:
    """Periods [s] of a part's ticks."""
    sizes = [traced.period.size1_in(k) for k in range(1, 5)]
    zeros = [ca.DM.zeros(n) for n in sizes]
    return np.array(traced.period(0.0, *zeros, *_parameters(form, fluid, traced))).ravel()


def ticking_line(form: Component, fluid: Fluid, traced: Trace) -> TickingLine | None:
    """The line of these equations; None without one tick, or where states do more than count."""
    ticks = [event for event in traced.events if event.kind == "every"]
    if len(ticks) != 1 or not all(s.counts for s in type(form).declared(State)):
        return None
    line = TickingLine(form, fluid, traced)
    return line if line.counts_alone else None


def _by(value: ca.SX, *variables: ca.SX) -> list[ca.SX]:
    return [ca.jacobian(value, v) for v in variables]
