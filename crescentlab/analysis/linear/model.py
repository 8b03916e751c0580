"""A, B, C, D of a circuit at an operating point, exact, in memory.

.. math:: \\delta\\dot x = A\\,\\delta x + B u, \\qquad \\delta y = C\\,\\delta x + D u

With ticks (a Lax-Wendroff line, a sampled part) the same from just after one tick to just after the next, T later:

.. math:: \\delta z_{k+1} = A\\,\\delta z_k + B u_k, \\qquad \\delta y_k = C\\,\\delta z_k + D u_k

where z are the states and the held values that tick, and B holds for an input that is constant over the tick; the
frequency response takes a continuous sine. What only counts up (:func:`crescentlab.component.state`, ``counts``) is
left out unless something reads it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

from crescentlab import arguments
from crescentlab.analysis.derivatives import Derivatives, Output, Point, output_named
from crescentlab.analysis.linear.boundaries import one_sided
from crescentlab.analysis.linear.inputs import Input, Inputs
from crescentlab.analysis.linear.reduction import Reduction, still_states
from crescentlab.analysis.linear.transfer_paths import check_paths
from crescentlab.analysis.tick_map import tick_map
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit, Start, check_circuit, snapshot_of
from crescentlab.elaborate import Design
from crescentlab.errors import InputError
from crescentlab.result import Result
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.system import System
from crescentlab.units import Quantity

if TYPE_CHECKING:
    from crescentlab.analysis.steady import OperatingPoint

Array = np.ndarray

AT_REST = 1e-5
"""Largest residual of an operating point: the part of its usual size by which a state misses its rest."""
SPARSE_FROM, SPARSE_SHARE = 60, 0.1
"""States from which, and share of entries up to which, a matrix is solved as a sparse one."""


@dataclass(frozen=True)
class LinearModel:
    """Matrices in SI with the names that go with them; see the module docstring. Made by :func:`linearize`."""

    states: tuple[str, ...]
    quantities: tuple[Quantity, ...]
    scale: Array
    """Usual size of each state [its unit]: what "small" means for it."""
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    A: Array
    B: Array
    C: Array
    D: Array
    still: tuple[str, ...]
    """States that do not move to first order here although their equations could: a part on its stop."""
    residual: float
    """How far from rest: max over states of |f| over the rate that all states together, moved by their size, give."""
    at: Snapshot
    system: System = field(repr=False)
    design: Design = field(repr=False)
    warnings: tuple[str, ...] = ()
    period: float | None = None
    """Period of the ticks [s]; None without."""
    powers: Array | None = field(default=None, repr=False)
    """Response of z over a tick to u = (tau/T)^k/k!, shape (z, k, inputs)."""
    direct: Array | None = field(default=None, repr=False)
    """Response of z to u at the tick itself, shape (z, inputs)."""

    def __repr__(self) -> str:
        """Its shape, and what it leads from and to."""
        inputs, outputs = (
            ", ".join(each.name for each in several[:8]) or "none" for several in (self.inputs, self.outputs)
        )
        kind = "" if self.period is None else f", sampled each {self.period:g} s"
        return (
            f"<LinearModel of {len(self.states)} states{kind}, residual {self.residual:.1e}; "
            f"{len(self.inputs)} inputs: {inputs}; {len(self.outputs)} outputs: {outputs}>"
        )

    @property
    def nyquist(self) -> float:
        """Angular frequency [rad/s] at which the ticks sample twice a period; infinite without ticks."""
        return np.inf if self.period is None else np.pi / self.period

    @property
    def driven(self) -> Array:
        """How much each input drives each state at all, over a tick where there are ticks, shape (states, inputs)."""
        if self.powers is None or self.direct is None:
            return np.asarray(np.abs(self.B))
        return np.asarray(np.abs(self.powers).sum(axis=1) + np.abs(self.direct))

    def response(self, omega: Array) -> Array:
        """Complex y/u at angular frequencies omega [rad/s], shape (m, outputs, inputs).

        With ticks: at the instants just after them; raises :class:`InputError` at and above :attr:`nyquist`.
        """
        omega = np.asarray(omega, dtype=float)
        if omega.size and not (omega.min() > 0 and omega.max() < self.nyquist):
            least = f"below half of a sample per tick, {self.nyquist / 2 / np.pi:.4g} Hz" if self.period else "finite"
            raise InputError(f"frequencies must be above 0 and {least}")
        solve, C = shifted_solver(self.A * self.scale / self.scale[:, None]), self.C * self.scale
        found = np.empty((omega.size, len(self.outputs), len(self.inputs)), dtype=complex)
        for k, w in enumerate(omega):
            s, drive = self._drive(w)
            found[k] = C @ solve(s, drive / self.scale[:, None]) + self.D
        return found

    def _drive(self, omega: float) -> tuple[complex, Array]:
        """The point s or z of the transform, and what the input brings into the states there."""
        if self.period is None:
            return 1j * omega, self.B.astype(complex)
        assert self.powers is not None
        assert self.direct is not None
        turn = 1j * omega * self.period
        series = turn ** np.arange(self.powers.shape[1])
        return np.exp(turn), np.einsum("k,zki->zi", series, self.powers) + self.direct * np.exp(turn)

    def select(self, inputs: Sequence[str], outputs: Sequence[str]) -> LinearModel:
        """The same model with some of its inputs and outputs."""
        i = [[u.name for u in self.inputs].index(name) for name in inputs]
        o = [[y.name for y in self.outputs].index(name) for name in outputs]
        return replace(
            self, inputs=tuple(self.inputs[k] for k in i), outputs=tuple(self.outputs[k] for k in o),
            B=self.B[:, i], C=self.C[o], D=self.D[np.ix_(o, i)],
            powers=None if self.powers is None else self.powers[:, :, i],
            direct=None if self.direct is None else self.direct[:, i],
        )  # fmt: skip


def shifted_solver(A: Array) -> Callable[[complex, Array], Array]:
    """A function of s and B that gives (s 1 - A)^-1 B, complex; sparse where A is."""
    n = len(A)
    if n < SPARSE_FROM or np.count_nonzero(A) > SPARSE_SHARE * n * n:
        return lambda s, B: np.asarray(np.linalg.solve(s * np.eye(n) - A, B))
    sparse, one = csc_array(A.astype(complex)), eye_array(n, dtype=complex, format="csc")
    return lambda s, B: np.asarray(splu(csc_array(s * one - sparse)).solve(B.astype(complex)))


def linearize(
    circuit: Circuit, parameters: Settings | None = None, *,
    at: OperatingPoint | Start | None = None,
    inputs: Sequence[str] = (), outputs: Sequence[str] = (),
) -> LinearModel:  # fmt: skip
    """The linear model of a circuit at rest, or wherever ``at`` says: an operating point, the end of a run, its file.

    Inputs are parameters (``throttle.area``, ``fluid.bulk_modulus``, the circuit's own ``supply``) or nets, into which
    a flow, force or torque is brought; outputs are variables. An input that reaches no output, or an output that no
    input reaches, raises :class:`InputError`; another pair without a path is named in ``warnings``.
    """
    model = linear_model(circuit, parameters, at=at, inputs=inputs, outputs=outputs)
    return replace(model, warnings=(*model.warnings, *check_paths(model)))


def linear_model(
    circuit: Circuit, parameters: Settings | None = None, *,
    at: OperatingPoint | Start | None = None,
    inputs: Sequence[str] = (), outputs: Sequence[str] = (), ticking: bool = True,
) -> LinearModel:  # fmt: skip
    """As :func:`linearize`, whether or not the inputs reach the outputs.

    Without ``ticking`` all held values stay as they are, and ticks do not happen: the differential equations alone.
    """
    check_circuit(circuit, "linearize")
    settings = arguments.settings(parameters)
    inputs, outputs = arguments.names(inputs, "inputs", "supply"), arguments.names(outputs, "outputs")
    plain = circuit.design(settings)
    snapshot = operating_point(circuit, settings, at)
    work = Inputs(circuit, settings, plain)
    design = work.probe(inputs)
    system = circuit.assembled(design)
    values = system.values(design)
    if (snapshot.x.size, snapshot.h.size, snapshot.b.size) != (system.x.numel(), system.h.numel(), system.b.numel()):
        raise InputError("the operating point belongs to a circuit of other parts; give it the same --set")
    wanted = [output_named(system, name) for name in dict.fromkeys(outputs)]
    placed = [_acting(u, system, wanted) for u in work.place(list(dict.fromkeys(inputs)), system)]
    one = _Linearising(system, design, snapshot, values.p, placed, wanted)
    return one.done() if ticking else one.continuous()


def operating_point(circuit: Circuit, settings: Settings, at: OperatingPoint | Start | None) -> Snapshot:
    """The point that ``at`` names, by default the circuit's point of rest."""
    if at is None:
        from crescentlab.analysis.steady import steady

        return steady(circuit, settings).snapshot
    if isinstance(at, (Snapshot, Result, Path, str)):
        return snapshot_of(at, circuit.system(settings))
    if not hasattr(at, "snapshot"):
        raise InputError(f"at: {at!r} is neither an operating point, nor a result or its file")
    return at.snapshot


def _acting(wanted: Input, system: System, outputs: Sequence[Output]) -> Input:
    """The input on those parameters alone that stand in the equations; others, such as start values, change nothing."""
    if wanted.probe:
        return wanted
    places = [k for k, _ in wanted.direction]
    parts = [system.f, system.periods, *(system.find(o.base).expression()[o.element] for o in outputs)]
    if any(event.kind == "every" for event in system.events):
        parts += system.remapping([event.kind == "every" for event in system.events])[1]
    stands = ca.jacobian_sparsity(ca.vertcat(*parts), system.p[places])
    columns = set(np.array(stands.get_triplet()[1], dtype=int).tolist())
    direction = tuple(pair for k, pair in enumerate(wanted.direction) if k in columns)
    if not direction:
        raise InputError(f"input {wanted.name}: no equation contains it, so nothing follows it; name another one")
    return replace(wanted, direction=direction)


def _tick_period(system: System, p: Array) -> float | None:
    """The one period of all ticks [s]; None without ticks; raises :class:`InputError` for several."""
    names = [event.name for event in system.events if event.kind == "every"]
    if not names:
        return None
    periods = np.array(system.period(p)).ravel()
    if np.ptp(periods) > 1e-12 * periods[0]:
        shown = ", ".join(f"{n} every {t * 1e6:.4g} us" for n, t in zip(names, periods, strict=True))
        raise InputError(
            f"the ticks have several periods ({shown}); a linear model needs one: give these parts equal periods "
            "(for lines: internal_nodes and courant_number), or make them part of the differential equations"
        )
    return float(periods[0])


class _Linearising:
    """One linearisation at work."""

    def __init__(
        self, system: System, design: Design, at: Snapshot, p: Array, inputs: Sequence[Input], outputs: Sequence[Output]
    ) -> None:
        self.system, self.design, self.at = system, design, at
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.places = sorted({k for u in inputs for k, _ in u.direction})
        self.directions = np.zeros((len(self.places), len(inputs)))
        for j, u in enumerate(inputs):
            for k, slope in u.direction:
                self.directions[self.places.index(k), j] += slope
        self.derivatives = Derivatives(system, self.places, outputs)
        self.point = Point(at.t, at.x, at.h, at.b, p)
        self.sizes = np.where(system.counting_states, system.nominal, np.maximum(np.abs(at.x), system.nominal))
        self.warnings: list[str] = []

    def done(self) -> LinearModel:
        period = _tick_period(self.system, self.point.p)
        model = self.continuous() if period is None else self.sampled(period)
        if period is None:
            self._check_time()
        said = one_sided(self.derivatives, self.point)
        if model.still:
            shown = ", ".join(model.still[:6]) + (" and others" if len(model.still) > 6 else "")
            said.append(f"to first order nothing moves {shown} here: a part on its stop, or closed")
        if not model.residual <= AT_REST:
            said.insert(0, f"this is no point of rest: its residual is {model.residual:.2g}, more than {AT_REST:g}")
        return replace(model, warnings=(*self.warnings, *said))

    def _check_time(self) -> None:
        """Warn of equations that change with time."""
        local = self.derivatives.at(self.point)
        size = np.abs(local.f_x) @ self.sizes
        moving = np.flatnonzero(np.abs(local.f_t) > 1e-9 * size)
        if moving.size:
            names = ", ".join(self.system.state_names[k] for k in moving[:4])
            self.warnings.append(f"the equations of {names} change with time; what is linearised is this one instant")

    def residual(self, f: Array, f_x: Array) -> float:
        """How far from rest; what counts up may go on."""
        rest = ~self.system.counting_states
        size = np.abs(f_x) @ self.sizes
        idle = size == 0  # nothing moves it: then any rate is a drift, by the state's own size in a second
        share = np.abs(f) / np.where(idle, self.sizes, size)
        return float(share[rest].max(initial=0.0))

    # -- without ticks ----------------------------------------------------------------------------

    def continuous(self) -> LinearModel:
        s = self.system
        local = self.derivatives.at(self.point)
        A, B, C, D = local.f_x, local.f_p @ self.directions, local.y_x, local.y_p @ self.directions
        kept = ~self._unread(A, C, s.counting_states)
        keep = np.flatnonzero(kept)
        still = still_states(A, B, np.zeros(len(A)), self.derivatives.pattern, kept)
        return LinearModel(
            tuple(s.state_names[k] for k in keep), tuple(s.state_quantities[k] for k in keep), self.sizes[keep],
            self.inputs, self.outputs, A[np.ix_(keep, keep)], B[keep], C[:, keep], D,
            tuple(s.state_names[k] for k in np.flatnonzero(still)),
            self.residual(local.f, A), self.at, s, self.design,
        )  # fmt: skip

    def _unread(self, A: Array, C: Array, counting: Array) -> Array:
        """Which counters nothing reads but counters."""
        read = np.abs(A) * counting > 0
        gone = counting.copy()
        while True:
            now = gone & ~read[~gone].any(axis=0) & ~(np.abs(C) > 0).any(axis=0)
            if np.array_equal(now, gone):
                return gone
            gone = now

    # -- with ticks -------------------------------------------------------------------------------

    def sampled(self, period: float) -> LinearModel:
        s = self.system
        if self.places:
            moves = np.array(ca.jacobian_sparsity(s.periods, s.p[self.places]).row(), dtype=int)
            if moves.size:
                raise InputError("an input moves the times of the ticks, which has no linear model; name another one")
        n = s.x.numel()
        usual = np.array([q.nominal for q in s.held_quantities])
        held = np.where(s.counting_held, usual, np.maximum(np.abs(self.at.h), usual))
        units = np.concatenate([self.sizes, held, [u.quantity.nominal for u in self.inputs]])
        start = self._just_after_a_tick(period)
        local = self.derivatives.at(start)
        made = tick_map(self.derivatives, start, period, self.directions, units)
        C = np.hstack([local.y_x, local.y_h]) * units[: n + s.h.numel()]
        small = Reduction(made, C, np.concatenate([s.counting_states, s.counting_held]), n)
        small.reduce()
        keep = small.keep
        scale, u = units[keep], units[n + s.h.numel() :]
        names, quantities = s.state_names + s.held_names, s.state_quantities + s.held_quantities
        powers = small.powers[keep] * scale[:, None, None] / u
        direct = made.direct[keep] * scale[:, None] / u
        still = still_states(small.M, small.drive(), np.ones(len(small.M)), self._pattern(), small.kept)
        if made.doubt:
            self.warnings.append(made.doubt)
        rest = made.step[keep[~np.concatenate([s.counting_states, s.counting_held])[keep]]]
        return LinearModel(
            tuple(names[k] for k in keep), tuple(quantities[k] for k in keep), scale, self.inputs, self.outputs,
            small.M[np.ix_(keep, keep)] * scale[:, None] / scale, powers[:, 0] + direct, small.C[:, keep] / scale,
            local.y_p @ self.directions, tuple(names[k] for k in np.flatnonzero(still)),
            max(self.residual(made.rate, local.f_x), float(np.abs(rest).max(initial=0.0))),
            self.at, s, self.design, (), period, powers, direct,
        )  # fmt: skip

    def _pattern(self) -> Array:
        return np.concatenate([self.derivatives.pattern, np.zeros(self.system.h.numel(), bool)])

    def _just_after_a_tick(self, period: float) -> Point:
        """The operating point at the last tick: what counts is moved back there."""
        at = self.at
        last = at.origin + at.ticked * at.period
        if np.ptp(last) > 1e-6 * period:
            raise InputError(
                "the ticks are out of step with each other here; linearise at a run begun with all of them"
            )
        t = float(last[0])
        rate = np.where(self.system.counting_states, self.derivatives.at(self.point).f, 0.0)
        return self.point.moved(t=t, x=at.x - rate * (at.t - t))
