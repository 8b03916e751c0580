"""The same chain and the same relief valve in other tools, at the same accuracy.

    python benchmarks/peers.py [--problems chain40,chain200,valve] [--rounds 3] [--limit 90] [--own rodas]

Problems: N volumes and N orifices one after another, fed by a pulsating source (N = 40, 200), and the shipped circuit
relief_valve. Each tool runs as its expert would set it up: ``solve_ivp`` on hand-written numpy with the exact banded or
sparse Jacobian (for the valve on plain floats, the spool's lift-off as an event); PathSim as one ODE block with its
exact Jacobian and as a block diagram; bdsim as a vector integrator and one function block. The hand-written equations
are the laws of the docstrings of ``components``, written anew; a reference made from them alone, at rtol 1e-11, is what
all errors are against, and crescentlab at rtol 1e-11 must agree with it.

Error: largest difference to the reference over all states and all instants the tool itself recorded, each state over
its largest value (chain: over the largest pressure). crescentlab runs at rtol 1e-6 with its default solver; of every
other tool the loosest tolerance (in half decades) whose error is no larger is taken, and of its solvers the quickest.
"first" is building the model and running it once, "again" a repeated run of the built model. Runs are interleaved, and
ratios are medians within one round: quote ratios, not seconds.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import math
import signal
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse
from scipy.integrate import solve_ivp

import crescentlab as cl
from crescentlab.circuit import SOLVERS, Circuit
from crescentlab.netlist import Netlist
from crescentlab.solvers.integrate import integrate
from crescentlab.solvers.options import Options

LADDER = tuple(10.0 ** (-k / 2) for k in range(5, 23))
"""Tolerances tried, loosest first."""
TIGHT = 1e-11
LONG = 2.0
"""Runs longer than this [s] are not repeated to choose the quickest solver of a tool."""
AGREEMENT = 1e-7
"""Two tight runs of the same physics differ by less than this."""

EXPLICIT, DIAGRAM = "PathSim, one block, explicit", "PathSim, block diagram"

Run = Callable[[], tuple[np.ndarray, np.ndarray]]
"""One run: times (m,), states (m, n) in the problem's units."""
Build = Callable[[float], Run]
"""A model built for a relative tolerance."""


class TooSlowError(Exception):
    """A run took longer than the limit."""


class InaccurateError(Exception):
    """No tolerance of the ladder reached the accuracy asked for."""


# -- the chain, by hand --------------------------------------------------------------------------------------


class Chain:
    """n volumes of 70 cm^3, an orifice of 2 mm^2 after each, a tank at the end, a pulsating source at the first.

    .. math:: \\dot p_i = \\frac{\\beta}{V} e^{-p_i/\\beta} (q_{i-1} - q_i), \\quad
              q = C_d A \\sqrt{2\\rho|\\Delta p|}/\\rho_0\\,\\mathrm{sign}\\,\\Delta p

    States p in bar, gauge. The orifice law is ``orifice``'s, evaluated as K (2 dp/rho_0) T(k^2 |u|) with u = 2 dp/rho
    and T(s) = tanh(sqrt s)/sqrt s, for which d(u T)/du = D = (T + 1/cosh^2 sqrt s)/2.
    """

    volume, area, rho_0, nu, beta = 70e-6, 2e-6, 860.0, 35e-6, 1.4e9
    mean, amplitude, frequency = 2e-3 / 60, 1e-3 / 60, 200.0
    cd_max, lambda_c, rounding = 0.7, 100.0, 1e-6
    stop = 0.05

    def __init__(self, n: int) -> None:
        self.n, self.title = n, f"chain of {n} volumes and {n} orifices, {self.stop * 1e3:g} ms"
        self.x0 = np.zeros(n)
        d_h = math.sqrt(4 * self.area / math.pi + self.rounding**2)
        self.k = 2 * d_h / (self.nu * self.lambda_c)
        self.K = self.area * self.cd_max * self.k
        self.omega = 2 * math.pi * self.frequency
        self.places = sparse.diags([np.ones(n - 1), np.ones(n), np.ones(n - 1)], [-1, 0, 1], format="csc")
        coo = self.places.tocoo()
        self.band = (1 + coo.row - coo.col, coo.col)

    def circuit(self) -> Circuit:
        """The same for crescentlab."""
        n = self.n
        components: dict[str, dict[str, str]] = {
            "tank": {"type": "tank"}, "source": {"type": "signal_flow_source"},
            "sine": {"type": "sine", "mean": "2 L/min", "amplitude": "1 L/min", "frequency": "200 Hz"},
        }  # fmt: skip
        nets = {"flow": ["sine.y", "source.flow"]}
        for k in range(n):
            components[f"v{k}"] = {"type": "capacity", "volume": "70 cm^3"}
            components[f"o{k}"] = {"type": "orifice", "area": "2 mm^2"}
            nets[f"n{k}"] = [f"v{k}.port", f"o{k}.a", f"o{k - 1}.b" if k else "source.port"]
        nets["out"] = [f"o{n - 1}.b", "tank.port"]
        fluid = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt",
                 "bulk_modulus": "1.4 GPa"}  # fmt: skip
        return Circuit(Netlist.of({"crescentlab": 1, "fluid": fluid, "components": components, "nets": nets}, "chain"))

    def states(self) -> list[tuple[str, float]]:
        """crescentlab's names of the states, and SI values of their units here."""
        return [(f"v{k}.p", 1e5) for k in range(self.n)]

    def scales(self, x: np.ndarray) -> np.ndarray:
        """What errors of the states are measured by."""
        return np.full(self.n, np.abs(x).max())

    def source(self, t: float) -> float:
        """Flow [m^3/s] into the first volume."""
        return self.mean + self.amplitude * math.sin(self.omega * t)

    def orifices(self, p: np.ndarray) -> tuple[np.ndarray, ...]:
        """Flows, and what their derivatives are made of; p [Pa]."""
        after = np.append(p[1:], 0.0)
        drop = p - after
        rho = self.rho_0 * np.exp((p + after) / (2 * self.beta))
        u = 2 * drop / rho
        s = self.k**2 * np.abs(u)
        r = np.sqrt(np.maximum(s, 1e-3))
        low = np.minimum(s, 1e-3)
        T = np.where(s < 1e-3, 1 - low / 3 + 2 * low**2 / 15 - 17 * low**3 / 315, np.tanh(r) / r)
        return self.K * 2 * drop / self.rho_0 * T, T, s, drop

    def rates(self, t: float, x: np.ndarray) -> np.ndarray:
        """dx/dt [bar/s]."""
        p = x * 1e5
        q = self.orifices(p)[0]
        inflow = np.concatenate(([self.source(t)], q[:-1]))
        return self.beta / self.volume / 1e5 * np.exp(-p / self.beta) * (inflow - q)

    def diagonals(self, t: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Below, on and above the diagonal of the Jacobian [1/s]."""
        p = x * 1e5
        q, T, s, drop = self.orifices(p)
        D = (T + 1 / np.cosh(np.minimum(np.sqrt(s), 300.0)) ** 2) / 2
        thinner = (D - T) * drop / self.beta
        q_a, q_b = self.K * (2 * D - thinner) / self.rho_0, -self.K * (2 * D + thinner) / self.rho_0
        inflow = np.concatenate(([self.source(t)], q[:-1]))
        factor = self.beta / self.volume * np.exp(-p / self.beta)
        before = np.concatenate(([0.0], q_b[:-1]))
        return factor[1:] * q_a[:-1], factor * (before - q_a - (inflow - q) / self.beta), -factor[:-1] * q_b[:-1]

    def banded(self, t: float, x: np.ndarray) -> np.ndarray:
        """Jacobian packed by diagonals for LSODA."""
        packed = np.zeros((3, self.n))
        packed[2, :-1], packed[1], packed[0, 1:] = self.diagonals(t, x)
        return packed

    def sparse(self, t: float, x: np.ndarray) -> sparse.csc_matrix:
        """Jacobian of the fixed pattern ``places``."""
        return sparse.csc_matrix(
            (self.banded(t, x)[self.band], self.places.indices, self.places.indptr), shape=self.places.shape
        )

    def dense(self, t: float, x: np.ndarray) -> np.ndarray:
        """Full Jacobian."""
        below, on, above = self.diagonals(t, x)
        matrix = np.zeros((self.n, self.n))
        flat = matrix.reshape(-1)
        flat[self.n :: self.n + 1], flat[:: self.n + 1], flat[1 :: self.n + 1] = below, on, above
        return matrix


# -- the relief valve, by hand -------------------------------------------------------------------------------


class Valve:
    """The shipped circuit relief_valve: a volume, a spool on its seat, four round holes, aerated oil.

    States p [bar, gauge], x [mm], v [cm/s]. The laws are those of ``aerated_oil``, ``round_holes``, ``spool_end``,
    ``spring_chamber_pressure`` and ``mass_with_stops``, in plain floats, which beat numpy at this size.
    """

    title = "relief_valve, 50 ms"
    n, stop = 3, 0.05
    units = (1e5, 1e-3, 1e-2)
    supply, volume = 30e-3 / 60, 70e-6
    rho_l, nu, beta_l, air, p_sat, index = 860.0, 35e-6, 1.4e9, 0.005, 1e8, 1.4
    p_atm, p_min, dissolution = 101325.0, 100.0, 0.01
    mass, spring, damping = 0.020, 9000.0, 100.0
    number, diameter, edge, drop_rounding = 4, 5.5e-3, 1e-6, 100.0
    cd_max, lambda_c, jet = 0.74, 50.0, 0.82 * math.cos(math.radians(69))
    linear, quadratic = 1.8e7, 1.296e11
    face = math.pi / 4 * 14e-3**2
    preload = 6.5e5 * face
    high = 4e-3

    def __init__(self) -> None:
        self.x0 = np.array([1.0, 0.0, 0.0])
        self.rho_0 = self.oil(0.0)[0]
        self.area_edge = self.segment(self.edge)[0]

    def circuit(self) -> Circuit:
        """The same for crescentlab."""
        return cl.load("relief_valve")

    def states(self) -> list[tuple[str, float]]:
        """crescentlab's names of the states, and SI values of their units here."""
        return list(zip(("line.p", "valve.spool.x", "valve.spool.v"), self.units, strict=True))

    def scales(self, x: np.ndarray) -> np.ndarray:
        """What errors of the states are measured by."""
        return np.abs(x).max(axis=0)

    def oil(self, p: float) -> tuple[float, float]:
        """Density [kg/m^3] and bulk modulus [Pa] at p [Pa, gauge]."""
        bare = p + self.p_atm
        root = math.sqrt(bare * bare + 4 * self.p_min**2)
        large = (abs(bare) + root) / 2
        P = large if bare > 0 else self.p_min**2 / large
        span, w = self.p_sat - self.p_atm, self.dissolution
        z = (self.p_sat - P) / span
        if z > w:
            x, dx = z, 1.0
        elif z > 0:
            x, dx = z * z * (2 * w - z) / (w * w), z * (4 * w - 3 * z) / (w * w)
        else:
            x, dx = 0.0, 0.0
        liquid = math.exp(-p / self.beta_l)
        gas = self.air / (1 - self.air) * (self.p_atm / P) ** (1 / self.index)
        size = liquid + gas * x
        slope = -liquid / self.beta_l + gas * (-dx / span - x / (self.index * P)) * P / root
        return self.rho_l / size, -size / slope

    def segment(self, h: float) -> tuple[float, float]:
        """Area [m^2] and wetted perimeter [m] of one hole uncovered up to h [m]."""
        r = self.diameter / 2
        cosine = 1 - h / r
        alpha, sine = math.acos(cosine), math.sqrt(1 - cosine * cosine)
        return r * r * (alpha - sine * cosine), 2 * r * (alpha + sine)

    def missing(self, h: float) -> float:
        """Share of the rounded edge's area that is missing at h [m]."""
        s = min(max(h / self.edge, 0.0), 1.0)
        return 1 - s * s * (1.5 - 0.5 * s)

    def holes(self, p: float, x: float) -> tuple[float, float]:
        """Flow [m^3/s] through all holes and the flow force [N] that closes them; p [Pa], x [m]."""
        inner, perimeter = self.segment(min(max(x, self.edge), self.diameter - self.edge))
        area = inner - self.area_edge * self.missing(x) + self.area_edge * self.missing(self.diameter - x)
        rho = self.oil(p / 2)[0]
        k = 2 * (4 * area / perimeter) / (self.nu * self.lambda_c)
        s = k * k * 2 * abs(p) / rho
        if s < 1e-3:
            T = 1 - s / 3 + 2 * s * s / 15 - 17 * s**3 / 315
        else:
            r = math.sqrt(s)
            T = math.tanh(r) / r
        q = self.number * area * self.cd_max * k * 2 * p / self.rho_0 * T
        rounded = math.hypot(p, self.drop_rounding)
        return q, self.jet * self.rho_0 * q * p / rounded * math.sqrt(2 * rounded / rho)

    def lift(self, p: float, x: float, v: float, q: float, jet: float) -> float:
        """Force [N] on the spool."""
        forward = max(q, 0.0)
        chamber = self.linear * forward + self.quadratic * forward * forward
        return (p - chamber) * self.face - self.preload - self.spring * x - self.damping * v - jet

    def pressure_rate(self, p: float, v: float, q: float) -> float:
        """dp/dt [Pa/s]."""
        rho, beta = self.oil(p)
        return beta / self.volume * (self.rho_0 / rho * (self.supply - q) - self.face * v)

    def force(self, y: np.ndarray) -> float:
        """Force [N] on the spool at a state in this problem's units."""
        p, x, v = float(y[0]) * 1e5, float(y[1]) * 1e-3, float(y[2]) * 1e-2
        return self.lift(p, x, v, *self.holes(p, x))

    def free(self, t: float, y: np.ndarray) -> list[float]:
        """dy/dt while the spool is free."""
        p, x, v = float(y[0]) * 1e5, float(y[1]) * 1e-3, float(y[2]) * 1e-2
        q, jet = self.holes(p, x)
        return [self.pressure_rate(p, v, q) / 1e5, v * 1e3, self.lift(p, x, v, q, jet) / self.mass * 1e2]

    def resting(self, t: float, y: np.ndarray) -> list[float]:
        """dy/dt while the spool rests on its seat."""
        p = float(y[0]) * 1e5
        return [self.pressure_rate(p, 0.0, self.holes(p, float(y[1]) * 1e-3)[0]) / 1e5, 0.0, 0.0]

    def kinked(self, t: float, y: np.ndarray) -> list[float]:
        """dy/dt with the seat as a condition in f: the same as long as the spool leaves it once and stays off."""
        rates = self.free(t, y)
        return rates if y[1] > 0 or rates[2] > 0 else self.resting(t, y)


Problem = Chain | Valve


# -- crescentlab and the reference ---------------------------------------------------------------------------


def crescentlab(problem: Problem, rtol: float, solver: str = "auto") -> Run:
    """The circuit, assembled; a run integrates it and gives all accepted steps."""
    circuit = problem.circuit()
    design, system = circuit.design(), circuit.system()
    values = system.values(design)
    names, units = zip(*problem.states(), strict=True)
    order = [system.state_names.index(name) for name in names]

    def run() -> tuple[np.ndarray, np.ndarray]:
        trajectory = integrate(system, values, Options(stop=problem.stop, rtol=rtol, solver=solver))
        assert trajectory.complete, trajectory.error
        t, x, _, _ = trajectory.steps.arrays()
        return t, x[:, order] / np.array(units)

    return run


@dataclass
class Reference:
    """The hand-written equations at a tight tolerance, as functions of time between the spool's events."""

    problem: Problem
    pieces: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        problem = self.problem
        settings = {"method": "DOP853", "rtol": TIGHT, "atol": TIGHT, "dense_output": True}
        if isinstance(problem, Chain):
            self.pieces = [solve_ivp(problem.rates, (0, problem.stop), problem.x0, **settings)]
        else:
            self.pieces = valve_pieces(problem, settings)
        every = np.concatenate([piece.y.T for piece in self.pieces])
        self.scales = problem.scales(every)

    def error(self, found: tuple[np.ndarray, np.ndarray]) -> float:
        """Largest difference of a run to the reference."""
        t, x = found
        worst, t = 0.0, np.minimum(t, self.problem.stop)
        assert t.max() >= self.problem.stop * (1 - 1e-9), f"ended at {t.max():g} s"
        for piece in self.pieces:
            inside = (t >= piece.t[0]) & (t <= piece.t[-1])
            if inside.any():
                worst = max(worst, float(np.max(np.abs(x[inside] - piece.sol(t[inside]).T) / self.scales)))
        return worst if np.isfinite(x).all() else math.inf


def valve_pieces(valve: Valve, settings: dict[str, Any]) -> list[Any]:
    """The valve by ``solve_ivp``, phase after phase: resting until the force lifts the spool, free until a stop."""

    def lifts(t: float, y: np.ndarray) -> float:
        return valve.force(y)

    def low(t: float, y: np.ndarray) -> float:
        return float(y[1])

    def high(t: float, y: np.ndarray) -> float:
        return float(y[1]) - valve.high * 1e3

    for event, direction in ((lifts, 1.0), (low, -1.0), (high, 1.0)):
        event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    pieces: list[Any] = []
    t, y, resting = 0.0, valve.x0, True
    while t < valve.stop:
        f, events = (valve.resting, [lifts]) if resting else (valve.free, [low, high])
        pieces.append(solve_ivp(f, (t, valve.stop), y, events=events, **settings))
        assert pieces[-1].status >= 0, pieces[-1].message
        t, y = float(pieces[-1].t[-1]), pieces[-1].y[:, -1]
        assert t == valve.stop or resting, "the spool came back to a stop, which no peer here is written for"
        resting = False
    return pieces


# -- the peers -----------------------------------------------------------------------------------------------


def valve_by_scipy(valve: Valve, rtol: float, method: str) -> Run:
    """``solve_ivp``, the lift-off as an event."""

    def run() -> tuple[np.ndarray, np.ndarray]:
        pieces = valve_pieces(valve, {"method": method, "rtol": rtol, "atol": rtol})
        return np.concatenate([p.t for p in pieces]), np.concatenate([p.y.T for p in pieces])

    return run


def chain_by_scipy(chain: Chain, rtol: float, **options: Any) -> Run:
    """``solve_ivp`` on vectorised numpy."""

    def run() -> tuple[np.ndarray, np.ndarray]:
        found = solve_ivp(chain.rates, (0, chain.stop), chain.x0, rtol=rtol, atol=rtol, **options)
        assert found.success, found.message
        return found.t, found.y.T

    return run


def scipy_peers(problem: Problem) -> dict[str, Build]:
    """``solve_ivp`` on the hand-written equations."""
    if isinstance(problem, Valve):
        return {m: partial(valve_by_scipy, problem, method=m) for m in ("LSODA", "RK45", "DOP853", "Radau", "BDF")}
    banded, exact = {"lband": 1, "uband": 1, "jac": problem.banded}, {"jac": problem.sparse}
    options = {"LSODA banded": banded, "BDF sparse": exact, "Radau sparse": exact, "RK45": {}, "DOP853": {}}
    return {name: partial(chain_by_scipy, problem, method=name.split()[0], **given) for name, given in options.items()}


def pathsim_run(
    problem: Problem, rtol: float, solver: str, blocks: list[Any], wires: list[Any], lifts: list[Any], free: list[bool]
) -> Run:  # fmt: skip
    """A PathSim model whose first block is the scope; a run resets it first. ``free``: whether the spool is."""
    from pathsim import Simulation, solvers

    simulation = Simulation(
        blocks, wires, lifts, dt=1e-6, Solver=getattr(solvers, solver), log=False,
        tolerance_lte_abs=rtol, tolerance_lte_rel=rtol,
    )  # fmt: skip

    def run() -> tuple[np.ndarray, np.ndarray]:
        free[0] = False
        simulation.run(problem.stop, reset=True)
        t, x = blocks[0].read()
        return np.asarray(t), np.asarray(x).T

    return run


def lift_off(force: Callable[[], float], free: list[bool]) -> Any:
    """The event at which the spool leaves its seat, located to 1e-5 N of a force that then rises by 3e5 N/s."""
    from pathsim.events import ZeroCrossingUp

    def leaves(t: float) -> None:
        free[0] = True

    return ZeroCrossingUp(lambda t: force(), leaves, tolerance=1e-5)


def pathsim_block(problem: Problem, rtol: float, solver: str) -> Run:
    """PathSim with everything in one ODE block; the chain's exact Jacobian is given."""
    from pathsim import Connection
    from pathsim.blocks import ODE, Scope

    free, lifts = [False], []
    if isinstance(problem, Chain):
        ode = ODE(lambda x, u, t: problem.rates(t, x), problem.x0, lambda x, u, t: problem.dense(t, x))
    else:
        ode = ODE(lambda x, u, t: np.array((problem.free if free[0] else problem.resting)(t, x)), problem.x0)
        lifts.append(lift_off(lambda: problem.force(ode.engine.state), free))
    scope = Scope()
    wires = [Connection(ode[: problem.n], scope[: problem.n])]
    return pathsim_run(problem, rtol, solver, [scope, ode], wires, lifts, free)


def pathsim_diagram(problem: Problem, rtol: float, solver: str) -> Run:
    """PathSim as a diagram: a block for every volume, orifice and law."""
    return (chain_diagram if isinstance(problem, Chain) else valve_diagram)(problem, rtol, solver)


def chain_diagram(chain: Chain, rtol: float, solver: str) -> Run:
    """A block for every volume and every orifice, in plain floats."""
    from pathsim import Connection
    from pathsim.blocks import ODE, Function, Scope, Source

    gain = chain.beta / chain.volume / 1e5

    def volume(x: np.ndarray, u: np.ndarray, t: float) -> np.ndarray:
        return gain * np.exp(-x * 1e5 / chain.beta) * (u[0] - u[1])

    def orifice(a: float, b: float) -> float:
        a, b = float(a) * 1e5, float(b) * 1e5
        w = 2 * (a - b) / chain.rho_0
        s = chain.k**2 * abs(w) / math.exp((a + b) / (2 * chain.beta))
        r = math.sqrt(s)
        return chain.K * w * (math.tanh(r) / r if s > 1e-3 else 1 - s / 3 + 2 * s**2 / 15 - 17 * s**3 / 315)

    n = chain.n
    volumes, orifices = [ODE(volume, np.zeros(1)) for _ in range(n)], [Function(orifice) for _ in range(n)]
    source, tank, scope = Source(chain.source), Source(lambda t: 0.0), Scope()
    wires = [Connection(source, volumes[0][0]), Connection(tank, orifices[-1][1])]
    for k in range(n):
        wires.append(Connection(volumes[k], orifices[k][0], scope[k], *([orifices[k - 1][1]] if k else [])))
        wires.append(Connection(orifices[k], volumes[k][1], *([volumes[k + 1][0]] if k < n - 1 else [])))
    return pathsim_run(chain, rtol, solver, [scope, source, tank, *volumes, *orifices], wires, [], [False])


def valve_diagram(valve: Valve, rtol: float, solver: str) -> Run:
    """Three integrators, a block for each law."""
    from pathsim import Connection
    from pathsim.blocks import Function, Integrator, Scope

    free = [False]
    p, x, v = (Integrator(start) for start in valve.x0)
    holes = Function(lambda p, x: valve.holes(p * 1e5, x * 1e-3))
    line = Function(lambda p, v, q: valve.pressure_rate(p * 1e5, v * 1e-2, q) / 1e5)
    force = Function(lambda p, x, v, q, jet: valve.lift(p * 1e5, x * 1e-3, v * 1e-2, q, jet))
    spool = Function(lambda f: f / valve.mass * 1e2 if free[0] else 0.0)
    speed, scope = Function(lambda v: v * 10), Scope()
    wires = [
        Connection(p, holes[0], line[0], force[0], scope[0]), Connection(x, holes[1], force[1], scope[1]),
        Connection(v, line[1], force[2], speed, scope[2]), Connection(holes[0], line[2], force[3]),
        Connection(holes[1], force[4]), Connection(force, spool), Connection(line, p), Connection(speed, x),
        Connection(spool, v),
    ]  # fmt: skip
    lifts = [lift_off(lambda: force.outputs[0], free)]
    return pathsim_run(valve, rtol, solver, [scope, p, x, v, holes, line, force, spool, speed], wires, lifts, free)


def bdsim_peers(problem: Problem) -> dict[str, Build]:
    """bdsim: a vector integrator fed by one function block; its solvers are those of ``solve_ivp``."""
    import bdsim

    options: dict[str, dict[str, Any]] = {"RK45": {}, "DOP853": {}, "LSODA": {}, "BDF": {}}
    if isinstance(problem, Chain):
        options["LSODA"] = {"lband": 1, "uband": 1}
        options["BDF"] = {"jac_sparsity": problem.places}

    def build(rtol: float, method: str, given: dict[str, Any]) -> Run:
        simulator = bdsim.BDSim(
            banner=False, toolboxes=False, sysargs=False, quiet=True, graphics=False, progress=False
        )
        diagram = simulator.blockdiagram()
        states, clock = diagram.INTEGRATOR(problem.x0), diagram.TIME()
        if isinstance(problem, Chain):
            rates = diagram.FUNCTION(problem.rates, nin=2)
        else:
            rates = diagram.FUNCTION(lambda t, y: np.array(problem.kinked(t, y)), nin=2)
        diagram.connect(clock, rates[0])
        diagram.connect(states, rates[1])
        diagram.connect(rates, states)
        diagram.compile()

        def run() -> tuple[np.ndarray, np.ndarray]:
            out = simulator.run(
                diagram, problem.stop, solver=method, solver_args={"rtol": rtol, "atol": rtol, **given},
                max_step=problem.stop, minstepsize=0.0,
            )  # fmt: skip
            return np.asarray(out.t), np.asarray(out.x)

        return run

    return {name: lambda rtol, name=name, given=given: build(rtol, name, given) for name, given in options.items()}


def peers(problem: Problem, own: list[str]) -> Iterator[tuple[str, dict[str, Build]]]:
    """Every tool that is installed with its solvers; for the others one line saying how to get them."""
    yield "crescentlab, solver by name", {o: partial(crescentlab, problem, solver=o) for o in own}
    yield "solve_ivp, by hand", scipy_peers(problem)
    if importlib.util.find_spec("pathsim") is None:
        print("PathSim is not installed and left out: pip install pathsim")
    else:
        explicit = ("RKBS32", "RKCK54", "RKDP54", "RKV65", "RKDP87")
        implicit = ("ESDIRK43", "GEAR52A", "GEAR54")
        yield EXPLICIT, {s: partial(pathsim_block, problem, solver=s) for s in explicit}
        yield "PathSim, one block, implicit", {s: partial(pathsim_block, problem, solver=s) for s in implicit}
        yield DIAGRAM, {s: partial(pathsim_diagram, problem, solver=s) for s in explicit}
    if importlib.util.find_spec("bdsim") is None:
        print("bdsim is not installed and left out: pip install bdsim")
    else:
        yield "bdsim, vector blocks", bdsim_peers(problem)


# -- tuning and timing ---------------------------------------------------------------------------------------


@contextlib.contextmanager
def within(seconds: float) -> Iterator[None]:
    """End what takes longer, where the system has timers."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def late(number: int, frame: Any) -> None:
        raise TooSlowError

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Wall time and result."""
    begun = time.perf_counter()
    result = run()
    return time.perf_counter() - begun, result


@dataclass
class Entry:
    """One line of the table."""

    name: str
    solver: str
    rtol: float
    run: Run
    first: float
    again: float
    error: float
    steps: int
    times: list[float] = field(default_factory=list)


def entry(name: str, solver: str, build: Build, rtol: float, reference: Reference, goal: float = math.inf) -> Entry:
    """Build, run, compare with the reference, run again; raises if the error is above ``goal``."""
    setup, run = timed(lambda: build(rtol))
    first, found = timed(run)
    error = reference.error(found)
    if error > goal:
        raise InaccurateError(error)
    again, _ = timed(run)
    return Entry(name, solver, rtol, run, setup + first, again, error, len(found[0]) - 1)


def tuned(
    name: str, solver: str, build: Build, goal: float, reference: Reference, limit: float, first: int
) -> Entry:  # fmt: skip
    """The loosest tolerance of the ladder, from rung ``first`` on, whose error is at most ``goal``.

    Rungs that cannot do, errors falling no faster than tolerances to the power 1.2, are left out.
    """
    rung = first
    with within(limit):
        while rung < len(LADDER):
            try:
                return entry(name, solver, build, LADDER[rung], reference, goal)
            except InaccurateError as missed:
                error = float(missed.args[0])
                lack = math.log10(error / goal) / 1.2 if math.isfinite(error) else 0.0
                rung += max(1, math.ceil(2 * lack - 1e-9))
            except (AssertionError, ValueError, RuntimeError):
                rung += 1
    raise InaccurateError


def quickest(name: str, builds: dict[str, Build], mine: Entry, reference: Reference, limit: float, first: int) -> Entry:
    """Of one tool the solver that reaches ``mine``'s accuracy in the shortest time; says what each took."""
    best, least = None, math.inf
    for solver, build in builds.items():
        said = f"  {name}: {solver}"
        try:
            found = tuned(name, solver, build, mine.error, reference, limit, first)
        except TooSlowError:
            print(f"{said} takes more than {limit:g} s to tune", flush=True)
        except InaccurateError:
            print(f"{said} does not reach the accuracy", flush=True)
        else:
            times = 1 if found.again > LONG else 3
            ratio = statistics.median(timed(found.run)[0] / timed(mine.run)[0] for _ in range(times))
            print(f"{said} {ratio:.1f} at rtol {found.rtol:.0e}", flush=True)
            best, least = (found, ratio) if ratio < least else (best, least)
    if best is None:
        raise InaccurateError
    return best


def compare(problem: Problem, own: list[str], rounds: int, limit: float) -> None:
    """Print the table of one problem."""
    print(f"\n{problem.title}")
    reference = Reference(problem)
    agreement = reference.error(crescentlab(problem, TIGHT, "dop853")())
    print(f"crescentlab at rtol {TIGHT:g} (dop853) and the hand-written reference differ by {agreement:.1e}")
    assert agreement < AGREEMENT, "not the same physics"
    mine = entry("crescentlab", "auto", partial(crescentlab, problem), 1e-6, reference)
    entries = {mine.name: mine}
    print("ratio to a run of crescentlab beside it:")
    for name, builds in peers(problem, own):
        first, chosen = 0, builds
        if name == DIAGRAM and EXPLICIT in entries:  # slow: what was quickest on the same equations in one block
            like = entries[EXPLICIT]
            first, chosen = LADDER.index(like.rtol), {like.solver: builds[like.solver]}
        with contextlib.suppress(InaccurateError):
            entries[name] = quickest(name, chosen, mine, reference, limit, first)
    for _ in range(rounds):
        for one in entries.values():
            one.times.append(timed(one.run)[0])
    print(
        f"{'tool':30s} {'solver':14s} {'rtol':>7s} {'error':>8s} {'steps':>7s} {'first s':>8s} {'again s':>8s}   ratio"
    )
    for one in entries.values():
        ratio = statistics.median(a / b for a, b in zip(one.times, mine.times, strict=True))
        print(
            f"{one.name:30s} {one.solver:14s} {one.rtol:7.0e} {one.error:8.1e} {one.steps:7d} {one.first:8.3f} "
            f"{statistics.median(one.times):8.3f} {ratio:7.2f}",
            flush=True,
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", default="chain40,chain200,valve")
    parser.add_argument("--rounds", type=int, default=3, help="interleaved runs of each tool")
    parser.add_argument("--limit", type=float, default=90.0, help="seconds to tune one solver in")
    every = ",".join(solver for solver in SOLVERS if solver != "auto")
    parser.add_argument("--own", default=every, help="crescentlab's solvers to try beside its default")
    arguments = parser.parse_args()
    own = [solver for solver in arguments.own.split(",") if solver]
    for name in arguments.problems.split(","):
        problem = Valve() if name == "valve" else Chain(int(name.removeprefix("chain")))
        compare(problem, own, arguments.rounds, arguments.limit)


if __name__ == "__main__":
    main()
