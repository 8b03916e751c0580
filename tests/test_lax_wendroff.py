"""Lax-Wendroff line: the scheme, its ends and what it keeps, stepped by hand on floats against closed forms."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from building import circuit
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.lax_wendroff import (
    LaxWendroffLine,
    LaxWendroffLineGivesGives,
    LaxWendroffLineGivesTakes,
    LaxWendroffLineTakesGives,
    LaxWendroffLineTakesTakes,
)
from crescentlab.components.wave_laws import arriving_wave, full_step, half_step, pressure_of_density

from crescentlab.domain import Held
from crescentlab.errors import SimulationError
from crescentlab.maths import Failure
from crescentlab.symbols import Sym

THIN = SimpleOil(density=870.0, kinematic_viscosity=1e-9, bulk_modulus=1.6e9)
THICK = SimpleOil(density=870.0, kinematic_viscosity=460e-6, bulk_modulus=1.6e9)
AERATED = AeratedOil(
    density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9, air_fraction=0.005, saturation_pressure=1000e5
)
WAVE_SPEED = 1356.127  # m/s, sqrt(1.6e9/870)
FORMS = {
    "pp": LaxWendroffLineTakesTakes, "pq": LaxWendroffLineTakesGives,
    "qp": LaxWendroffLineGivesTakes, "qq": LaxWendroffLineGivesGives,
}  # fmt: skip
"""By what is prescribed at a and at b: p the pressure, q the flow into the line."""

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(4)


def area(diameter: float) -> float:
    return np.pi / 4 * diameter**2


class Run:
    """A line stepped tick by tick, its ends prescribed as functions of time; flows taken in by Gauss quadrature.

    The equations are traced once, for on floats thousands of ticks take half a minute.
    """

    def __init__(
        self, kind: str, fluid: Any, at_a: Callable[[float], float], at_b: Callable[[float], float], **values: Any
    ):
        self.line: LaxWendroffLine = FORMS[kind](**values)
        self.names, self.given = (f"{kind[0]}_a", f"{kind[1]}_b"), (at_a, at_b)
        self.world: dict[str, Any] = {"into_a": 0.0, "into_b": 0.0}
        for item in self.line.declared(Held):
            start = self.line.start_of(item, fluid)
            self.world[item.name] = start if item.size else float(start[0])
        symbols = {name: symbol(name, np.shape(value)) for name, value in self.world.items()}
        symbols |= {name: symbol(name, ()) for name in (*self.names, "t")}
        returned = self.line.equations(**symbols, fluid=fluid)
        tick = returned.pop("tick")
        self.dt = float(np.asarray(ca.evalf(Sym.of(tick.dt).sx)).item())
        self._inputs = list(symbols)
        self._values = compiled(symbols, returned)
        self._tick = compiled(symbols, tick.then)
        self.ticks = 0
        self.t: list[float] = []
        self.seen: list[dict[str, Any]] = []

    def at(self, t: float) -> dict[str, Any]:
        """What the equations return at t, with what is prescribed at the ends."""
        world = self.inputs(t)
        return {name: world[name] for name in self.names} | call(self._values, world)

    def inputs(self, t: float) -> dict[str, Any]:
        """What the equations ask for at t."""
        ends = {name: given(t) for name, given in zip(self.names, self.given, strict=True)}
        return {name: (self.world | ends | {"t": t})[name] for name in self._inputs}

    def note(self, t: float) -> None:
        self.t.append(t)
        self.seen.append(self.at(t))

    def go(self, ticks: int) -> "Run":
        for _ in range(ticks):
            t0, t1 = self.ticks * self.dt, (self.ticks + 1) * self.dt
            self.note(t0)
            flows = [self.at(t0 + self.dt * (1 + x) / 2) for x in GAUSS]
            for end in ("a", "b"):
                taken = sum(w * now[f"der_into_{end}"] for w, now in zip(WEIGHTS, flows, strict=True))
                self.world[f"into_{end}"] += self.dt / 2 * taken
            self.note(t1)
            self.world.update(call(self._tick, self.inputs(t1)))
            self.ticks += 1
        self.note(self.ticks * self.dt)
        return self

    def series(self, name: str) -> np.ndarray:
        return np.array([now[name] for now in self.seen])


def symbol(name: str, shape: tuple[int, ...]) -> Sym:
    return Sym(ca.SX.sym(name, *shape), shape)


def compiled(symbols: dict[str, Sym], returned: dict[str, Any]) -> ca.Function:
    outputs = {f"new_{name}": Sym.of(value).sx for name, value in returned.items() if not isinstance(value, Failure)}
    return ca.Function(
        "f", [s.sx for s in symbols.values()], list(outputs.values()), list(symbols), list(outputs)
    )  # fmt: skip


def call(function: ca.Function, inputs: dict[str, Any]) -> dict[str, Any]:
    values = function.call(list(inputs.values()))
    numbers = [v.full()[:, 0] if v.numel() > 1 else float(v) for v in values]
    return {name.removeprefix("new_"): value for name, value in zip(function.name_out(), numbers, strict=True)}


def no_friction(q: Any, p: Any) -> Any:
    return 0.0 * q


@pytest.mark.parametrize(
    ("nu", "theta"), list(itertools.product([0.3, 0.6, 0.9, 1.0], np.pi * np.array([0.1, 0.3, 0.5, 0.8, 1.0])))
)
def test_amplification(nu: float, theta: float) -> None:
    """A wave of phase theta per node keeps 1 - 4 nu^2 (1 - nu^2) sin^4(theta/2) of its energy per step.

    Von Neumann analysis of Lax-Wendroff (Hirsch 1990, 8.2). At 100 Pa the fluid is linear to 1e-7.
    """
    dx, bore = 0.1, 1e-3
    i = np.arange(41)
    p = 100.0 * np.exp(1j * theta * i)
    impedance = 870.0 * WAVE_SPEED / bore
    parts = []
    for part in (p.real, p.imag):
        dt = nu * dx / WAVE_SPEED
        between = half_step(part, part / impedance, dt, dx, bore, no_friction, THIN)
        p_new, q_new = full_step(part, part / impedance, between, dt, dx, bore, THIN)
        parts.append(p_new + impedance * q_new)
    gain = (parts[0] + 1j * parts[1]) / (2 * p[1:-1])
    expected = 1 - 4 * nu**2 * (1 - nu**2) * np.sin(theta / 2) ** 4
    assert np.abs(gain) ** 2 == pytest.approx(np.full(39, expected), abs=2e-6)


@pytest.mark.parametrize(
    ("kind", "wave_number", "courant"),
    [("qq", 1.0, 0.9), ("qq", 2.0, 0.5), ("pp", 1.0, 0.9), ("pq", 1.5, 0.9), ("qp", 0.5, 0.4)],
)
def test_second_order(kind: str, wave_number: float, courant: float) -> None:
    """A standing wave in a line with reflecting ends: exact is its cosine in time; the error falls as cells squared.

    p = P cos or sin(k x) cos(k a t), k = wave_number pi/L; d'Alembert. 1 kPa keeps the fluid linear to 1e-6.
    """
    length, k = 1.0, wave_number * np.pi
    shape = np.cos if kind[0] == "q" else np.sin
    errors = []
    for cells in (20, 40, 80):
        run = Run(
            kind, THIN, lambda t: 0.0, lambda t: 0.0, diameter=0.02, length=length, internal_nodes=cells - 1,
            max_pressure=1.0, courant_number=courant,
        )  # fmt: skip
        x = np.linspace(0.0, length, cells + 1)
        run.world["p_node"] = 1e3 * shape(k * x)
        run.go(round(1.3 * cells / courant))
        exact = 1e3 * shape(k * x) * np.cos(k * WAVE_SPEED * run.ticks * run.dt)
        errors.append(np.sqrt(np.mean((run.world["p_node"] - exact) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders.min() >= 1.8, (errors, orders)


def water_hammer(cells: int) -> Run:
    return Run(
        "pq", THIN, lambda t: 20e5, lambda t: 0.0, diameter=0.02, length=10.0, internal_nodes=cells - 1,
        max_pressure=20e5, start_pressure=20e5, start_flow=area(0.02),
    )  # fmt: skip


def test_joukowsky() -> None:
    """Stopping 1 m/s at once raises the pressure by rho a = 870 kg/m^3 * 1356.127 m/s: 11.798 bar (Joukowsky 1898).

    0.3 %, at once and until the reflection returns at 2 L/a: density and wave speed at 20 to 32 bar (0.1 %), friction
    of the 10 m line (0.02 bar). The jump does not ring at the valve.
    """
    run = water_hammer(80)
    start = run.world["p_node"][-1]
    run.go(80)
    rise = run.series("p_b")[np.array(run.t) < 1.8 * 10.0 / WAVE_SPEED] - start
    assert rise == pytest.approx(np.full(len(rise), 11.798e5), rel=3e-3)


def test_water_hammer_period() -> None:
    """The pressure at the valve crosses the reservoir's every 2 L/a = 14.748 ms, half of the period 4 L/a.

    0.5 %: of the 0.2 % measured, 0.06 % are the density at 20 bar and the rest is dispersion on 40 cells.
    """
    run = water_hammer(40).go(round(8.2 * 2 * 40 / 0.9))
    t, excess = np.array(run.t), run.series("p_b") - 20e5
    k = np.flatnonzero(excess[1:] * excess[:-1] < 0)
    crossings = t[k] + (t[k + 1] - t[k]) * excess[k] / (excess[k] - excess[k + 1])
    assert len(crossings) == 8
    assert (crossings[-1] - crossings[0]) / 7 == pytest.approx(14.748e-3, rel=5e-3)


def reflecting(cells: int, mean: float, swing: float, courant: float = 0.9) -> Run:
    run = Run(
        "qq", AERATED, lambda t: 0.0, lambda t: 0.0, diameter=0.012, length=0.72, internal_nodes=cells - 1,
        max_pressure=10e5, courant_number=courant,
    )  # fmt: skip
    run.world["p_node"] = mean + swing * np.cos(np.pi * np.linspace(0, 1, cells + 1))
    return run


@pytest.mark.parametrize("cells", [2, 3, 10, 25])
def test_fluid_is_kept_between_closed_ends(cells: int) -> None:
    """Closed at both ends over 1000 ticks the fluid in the line stays, and so does the bound of the wave.

    The fluxes telescope and those at the ends close the half cells' books, so only rounding remains: 1e-15 per tick.
    """
    run = reflecting(cells, 3e5, 2e5).go(1000)
    content = run.series("content")
    assert abs(content - content[0]).max() < 1e-12 * content[0]
    assert np.ptp(run.world["p_node"]) < 4e5
    assert run.series("courant").max() < 0.9


@pytest.mark.parametrize("cells", [2, 3, 4, 10])
def test_low_courant_number_is_stable(cells: int) -> None:
    """Near 0 bar, at a fifth of the wave speed at max_pressure, 2000 ticks do not feed a wave."""
    run = reflecting(cells, 0.2e5, 0.1e5).go(2000)
    assert run.series("courant").max() < 0.35
    assert np.ptp(run.world["p_node"]) < 0.2e5


@pytest.mark.parametrize("kind", FORMS)
def test_fluid_is_kept_and_ends_are_continuous(kind: str) -> None:
    """Content changes by what the ends take in, and pressure and flow at the ends do not jump at a tick.

    Both by construction, so to rounding; a two-frequency ripple on the pump's line, with entry loss and friction.
    """
    given = {
        "p": lambda t: 4e5 + 0.5e5 * np.sin(2 * np.pi * 433 * t),
        "q": lambda t: 4e-4 * (1 + 0.1 * np.sin(2 * np.pi * 866 * t)),
    }
    at_b = {"p": lambda t: 3.8e5 + 0.2e5 * np.sin(2 * np.pi * 866 * t), "q": lambda t: -given["q"](t)}
    run = Run(
        kind, AERATED, given[kind[0]], at_b[kind[1]], diameter=0.012, length=0.72, loss_coefficient=0.5,
        max_pressure=10e5, start_pressure=4e5, start_flow=4e-4,
    ).go(300)  # fmt: skip
    taken = run.world["into_a"] + run.world["into_b"]
    content = run.series("content")
    assert abs(content[-1] - content[0] - taken) < 1e-12 * run.world["into_a"]
    before, after = np.arange(1, 2 * 300, 2), np.arange(2, 2 * 300 + 1, 2)
    for name, size in (("p_a", 4e5), ("p_b", 4e5), ("q_a", 4e-4), ("q_b", 4e-4), ("content", content[0])):
        values = run.series(name)
        assert abs(values[after] - values[before]).max() < 1e-12 * size, name


def churchill(reynolds: float, roughness: float) -> float:
    a = (-2.457 * np.log((7 / reynolds) ** 0.9 + 0.27 * roughness)) ** 16
    b = (37530 / reynolds) ** 16
    return float(8 * ((8 / reynolds) ** 12 + (a + b) ** -1.5) ** (1 / 12))


def settled_drop(fluid: SimpleOil, q: float, ticks: int, **values: Any) -> float:
    run = Run(
        "pq",
        fluid,
        lambda t: 20e5,
        lambda t: -q,
        diameter=0.006,
        length=0.72,
        max_pressure=20e5,
        start_pressure=20e5,
        **values,
    )
    return float(20e5 - run.go(ticks).seen[-1]["p_b"])


def test_laminar_drop() -> None:
    """From rest the drop settles to 128 mu L q/(pi d^4) (Hagen-Poiseuille).

    1e-4: e^-14 remains of the start after 3000 ticks; density at 20 bar cancels.
    """
    q = 1e-4  # Re = 46
    expected = 128 * 460e-6 * 870 * 0.72 * q / (np.pi * 0.006**4)
    assert settled_drop(THICK, q, 3000) == pytest.approx(expected, rel=1e-4)


def test_turbulent_drop() -> None:
    """Started at its own steady flow, the line keeps f L/d rho v^2/2 with Churchill's f (1977), here written out.

    2e-3: density at 20 bar is 0.125 % above the one at 0 bar; it divides the drop at equal mass flow.
    """
    q, nu = 3e-4, 2e-6
    v = q / area(0.006)
    expected = churchill(v * 0.006 / nu, 1e-5 / 0.006) * 0.72 / 0.006 * 870 * v**2 / 2
    oil = SimpleOil(density=870.0, kinematic_viscosity=nu, bulk_modulus=1.6e9)
    assert settled_drop(oil, q, 400, roughness=1e-5, start_flow=q) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("q", [4e-4, -4e-4])
@pytest.mark.parametrize("kind", ["pq", "qq"])
def test_entry_loss(q: float, kind: str) -> None:
    """Between end a and the first node lies K rho_0 v^2/2, of the sign of the flow, in either causality.

    2e-3: what rings on of the start, which is steady but for the fluid's compressibility.
    """
    given = {"p": lambda t: 5e5, "q": lambda t: q}
    run = Run(
        kind, THIN, given[kind[0]], lambda t: -q, diameter=0.012, length=0.72, loss_coefficient=1.5, max_pressure=10e5,
        start_pressure=5e5, start_flow=q,
    ).go(50)  # fmt: skip
    loss = 1.5 * 870 / 2 * (q / area(0.012)) ** 2 * np.sign(q)
    assert run.seen[-1]["p_a"] - run.world["p_node"][0] == pytest.approx(loss, rel=2e-3)
    assert run.seen[-1]["q_a"] == pytest.approx(q, rel=1e-3)


def test_steady_flow_is_seen_steady() -> None:
    """In steady laminar flow the wave arriving at an end is the end's own pressure, whatever the time elapsed."""
    gradient, dx = 1e4, 0.1
    for elapsed in (0.0, 2e-5, 6e-5):
        wave = arriving_wave(
            (5e5, 5e5 - 1e3, 5e5 - 2e3), (1e-4,) * 3, elapsed, dx, lambda q, p: gradient * q / 1e-4, THICK
        )
        assert wave.p == pytest.approx(5e5, abs=1e-6)
        assert wave.q == pytest.approx(1e-4, rel=1e-12)


@pytest.mark.parametrize("p", [-0.9e5, -0.5e5, 0.0, 1e5, 6e5, 50e5])
def test_pressure_of_density(p: float) -> None:
    """Newton's method undoes rho(p): to rounding within half and double the absolute pressure, 10 Pa from 5 times."""
    absolute = p + 101325
    for factor, tolerance in ((0.5, 1e-5), (0.9, 1e-6), (1.2, 1e-6), (2.0, 1e-5), (5.0, 10.0)):
        found = pressure_of_density(AERATED.density(p), absolute * factor - 101325, AERATED)
        assert found == pytest.approx(p, abs=tolerance)


def test_courant_number_above_one_is_seen() -> None:
    """Above max_pressure the aerated oil is faster: a(20 bar)/a(5 bar) > 1/0.9, and the observables say so."""
    run = Run(
        "pp",
        AERATED,
        lambda t: 20e5,
        lambda t: 20e5,
        diameter=0.012,
        length=0.72,
        max_pressure=5e5,
        start_pressure=20e5,
    )
    now = run.at(0.0)
    speeds = [np.sqrt(AERATED.bulk_modulus(p) / AERATED.density(p)) for p in (20e5, 5e5)]
    assert now["courant"] == pytest.approx(0.9 * speeds[0] / speeds[1], rel=1e-12)
    assert now["courant"] > 1
    assert now["p_highest"] == 20e5


def test_number_of_nodes() -> None:
    """Cells are six diameters long unless nodes are given: the pump's 0.72 m of 12 mm has 9 (paper, section 6)."""
    pump = LaxWendroffLineTakesTakes(diameter=0.012, length=0.72, max_pressure=10e5)
    assert (pump.cells, pump.nodes) == (10, 11)
    assert LaxWendroffLineTakesTakes(diameter=0.012, length=0.05, max_pressure=10e5).cells == 2
    assert LaxWendroffLineTakesTakes(diameter=0.012, length=0.72, max_pressure=10e5, internal_nodes=19).cells == 20


def test_family() -> None:
    """The circuit's `lax_wendroff_line` has four forms, one per causality of its ends."""
    assert LaxWendroffLine.type_name() == "lax_wendroff_line"
    roles = {tuple(port.role for port in form.ports()) for form in LaxWendroffLine.forms()}
    assert roles == set(itertools.product(["takes", "gives"], repeat=2))


def test_a_node_inside_below_absolute_zero_ends_the_run() -> None:
    """Two waves of -0.7 bar from both ends of a line at 0 bar meet inside it, at L/(2 a): to -1.4 bar.

    d'Alembert; the ends stay at -0.7 bar. Told with the lines that go on, before the Courant number is looked at;
    within three ticks of 0.9/33 L/a, as the scheme spreads a front over some cells.
    """
    made = circuit(
        components={
            "left": {"type": "pressure_source", "pressure": "-0.7 bar"},
            "right": {"type": "pressure_source", "pressure": "-0.7 bar"},
            "line": {"type": "lax_wendroff_line", "length": "2 m", "diameter": "10 mm", "max_pressure": "5 bar"},
        },
        nets={"start": ["left.port", "line.a"], "end": ["line.b", "right.port"]},
        fluid={"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "1 cSt",
               "bulk_modulus": "1.6 GPa"},
        simulation={"stop": "5 ms"},
    )  # fmt: skip
    for solver in ("lsoda", "rodas"):
        with pytest.raises(SimulationError, match=r"at a node, below absolute zero; .*distributed_line") as failure:
            made.simulate(solver=solver)
        result = failure.value.result  # type: ignore[attr-defined]
        assert result.time[-1] == pytest.approx(1.0 / math.sqrt(1.6e9 / 870), rel=3 * 0.9 / 16.5)
