r"""What a line's own equations make of it: its two-port, linearised about the means of a run, and how wrong that is.

Both two-ports, the model's and the exact one, as scattering matrices,

.. math:: S = (I - Z Y)(I + Z Y)^{-1}, \qquad \varepsilon = \lVert S - S_{exact} \rVert_2

Y [m^3/(s Pa)] flows into the ends per end pressures, Z [Pa s/m^3] the magnitude of the characteristic impedance. S says
which part of the waves that enter leaves at each end: the error is the largest part of a wave that the model sends
elsewhere or later, at most 2, and resonances do not blow it up.
Source: K. Kurokawa, IEEE Trans. Microwave Theory Tech. 13 (1965) 194-202.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from crescentlab import units
from crescentlab.analysis.doctor.ticking_line import SAMPLES_PER_WAVE, periods_of, smallest_step, ticking_line
from crescentlab.analysis.linear.model import shifted_solver
from crescentlab.component import Component
from crescentlab.domain import HYDRAULIC, State
from crescentlab.fluid import Fluid
from crescentlab.trace import Trace, numeric_fields, trace

Array = np.ndarray

NEWTON = 30
OPEN = 1e-6
"""Slopes below this part of the steepest leave a state open."""


@dataclass(frozen=True)
class Ends:
    """Means of a run at a line's two ends: pressures [Pa] and flows into it [m^3/s]."""

    p_a: float
    p_b: float
    q_a: float
    q_b: float

    @property
    def p(self) -> float:
        """Mean pressure [Pa]."""
        return (self.p_a + self.p_b) / 2

    @property
    def q(self) -> float:
        """Mean flow from a to b [m^3/s]."""
        return (self.q_a - self.q_b) / 2

    def part(self, k: int, count: int) -> Ends:
        """Of the k-th of ``count`` equal parts."""
        fall = (self.p_a - self.p_b) / count
        return Ends(self.p_a - k * fall, self.p_a - (k + 1) * fall, self.q, -self.q)


def scattering_error(own: Array, exact: Array) -> Array:
    """Error per frequency, shape (m,), of two-ports (m, 2, 2); see the module."""
    impedance = 1 / np.sqrt(np.abs(np.linalg.det(exact)))[:, None, None]

    def scattering(y: Array) -> Array:
        return np.asarray((np.eye(2) - impedance * y) @ np.linalg.inv(np.eye(2) + impedance * y))

    return np.asarray(np.linalg.norm(scattering(own) - scattering(exact), ord=2, axis=(1, 2)))


def ports_of(part: Component) -> tuple[str, str]:
    """Names of a line's two ends: its first two hydraulic ports."""
    first, second = [port.name for port in type(part).ports() if port.domain is HYDRAULIC][:2]
    return first, second


def own_two_port(form: Component, fluid: Fluid, omega: Array, ends: Ends) -> Array | None:
    """Flows into the ends per end pressures [m^3/(s Pa)] by the component's own equations, shape (m, 2, 2).

    Linearised where its states rest between the means at its ends; of a part that ticks just after its ticks, see
    :mod:`.ticking_line`. None for a part with other ports, with several ticks, or with ticks and states besides, and
    where it has no rest.
    """
    first, second = ports_of(form)
    traced = trace(form, {"fluid": fluid})
    ours = {f"{v}_{port}" for v in ("p", "q") for port in (first, second)}
    if {n for n, _ in traced.inputs.slots} - ours:
        return None
    try:
        respond = _respond(form, fluid, traced, omega, ends)
    except np.linalg.LinAlgError:
        return None
    if respond is None or not np.isfinite(respond).all():
        return None
    rows = {name: respond[:, k] for k, (name, _) in enumerate(traced.outputs.slots)}
    unit = np.broadcast_to(np.eye(2), (omega.size, 2, 2))
    rows |= {name: unit[:, k] for k, (name, _) in enumerate(traced.inputs.slots)}
    pressures, flows = (np.stack([rows[f"{v}_{first}"], rows[f"{v}_{second}"]], axis=1) for v in ("p", "q"))
    return np.asarray(flows @ np.linalg.inv(pressures))


def _respond(form: Component, fluid: Fluid, traced: Trace, omega: Array, ends: Ends) -> Array | None:
    """What the ends give per what they receive, shape (m, outputs, inputs), with ticks or without."""
    if not any(event.kind == "every" for event in traced.events):
        return _response(form, fluid, traced, omega, ends)
    line = ticking_line(form, fluid, traced)
    return None if line is None else line.response(omega, ends.p, ends.q, _received(form, ends))


def tick_limit(form: Component, fluid: Fluid) -> float:
    """Angular frequency [rad/s] up to which a line is judged: a quarter of its tick rate; infinite without ticks."""
    traced = trace(form, {"fluid": fluid})
    if not any(event.kind == "every" for event in traced.events):
        return float("inf")
    return 2 * np.pi / (SAMPLES_PER_WAVE * float(periods_of(form, fluid, traced).max()))


def _received(form: Component, ends: Ends) -> dict[str, float]:
    """Means of all that an end may receive; of the flows that of both, which leaves a line at rest."""
    first, second = ports_of(form)
    return {f"p_{first}": ends.p_a, f"p_{second}": ends.p_b, f"q_{first}": ends.q, f"q_{second}": -ends.q}


def _response(form: Component, fluid: Fluid, traced: Trace, omega: Array, ends: Ends) -> Array:
    """What the ends give per what they receive, shape (m, outputs, inputs), of a part without ticks."""
    x, u, b = (ca.SX.sym(n, k) for n, k in (("x", traced.states.size), ("u", traced.inputs.size), ("b", _bits(traced))))
    p = [float(getattr(form, n)) for n in traced.parameters]
    pf = [float(getattr(fluid, n)) for n in numeric_fields(type(fluid), fluid)] if traced.fluids else []
    given = (0.0, x, ca.DM.zeros(traced.held.size), b, u, p, pf)
    rate, relation = traced.derivative(*given), traced.relation(*given)
    y = ca.SX.zeros(traced.outputs.size)
    for group in traced.groups:
        y[list(group.outputs)] = group.function(*given)
    slopes = [ca.densify(ca.jacobian(e, v)) for e in (rate, y) for v in (x, u)]
    law = ca.Function("line", [x, u, b], [ca.densify(rate), ca.densify(relation), *slopes])
    _, _, A, B, C, D = _at_rest(form, traced, law, ends)
    solve = shifted_solver(A)
    return np.stack([C @ solve(1j * w, B.astype(complex)) + D for w in omega])


def _bits(traced: Trace) -> int:
    return int(traced.relation.size1_out(0)) if traced.relations else 0


def _at_rest(form: Component, traced: Trace, law: ca.Function, ends: Ends) -> list[Array]:
    """The law where the states rest; what rest leaves open (a closed volume's pressure) stays at the mean."""
    first, second = ports_of(form)
    values = {f"p_{first}": ends.p_a, f"p_{second}": ends.p_b, f"q_{first}": ends.q_a, f"q_{second}": ends.q_b}
    u = np.array([values[name] for name, _ in traced.inputs.slots])
    x, scale = np.zeros(traced.states.size), np.ones(traced.states.size)
    for declared in type(form).declared(State):
        quantity, places = form.quantity(declared.quantity), list(traced.states.indices(declared.name))
        x[places] = ends.p if quantity is units.pressure else 0.0
        scale[places] = declared.nominal or quantity.nominal
    b = np.zeros(_bits(traced))
    for _ in range(NEWTON):
        found = [np.array(m) for m in law(x, u, b)]
        b = (found[1][:, 0] > 0).astype(float) if b.size else b
        slope, rate = found[2] * scale / scale[:, None], found[0].ravel() / scale
        step = scale * smallest_step(slope, -rate, OPEN)
        x = x + step
        if np.all(np.abs(step) <= 1e-9 * scale):
            break
    return [np.array(m) for m in law(x, u, b)]
