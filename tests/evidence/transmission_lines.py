"""The transmission line stepped tick by tick on prescribed ends, and valve slams with Zielke's friction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from crescentlab.components.distributed_lines import DistributedLineTakesGives
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.frequency_friction import MOST_TERMS
from crescentlab.components.transmission_lines import (
    TransmissionLine,
    TransmissionLineGivesGives,
    TransmissionLineGivesTakes,
    TransmissionLineTakesGives,
    TransmissionLineTakesTakes,
)

from crescentlab.domain import Held, State
from crescentlab.maths import Event, Failure
from crescentlab.symbols import Sym
from evidence import Number, evidence

OIL = SimpleOil(density=870.0, kinematic_viscosity=46e-6, bulk_modulus=1.6e9)
WAVE_SPEED = np.sqrt(1.6e9 / 870)
FORMS: dict[str, type[TransmissionLine]] = {
    "pp": TransmissionLineTakesTakes, "pq": TransmissionLineTakesGives,
    "qp": TransmissionLineGivesTakes, "qq": TransmissionLineGivesGives,
}  # fmt: skip
"""By what is prescribed at a and at b: p the pressure, q the flow into the line."""

SLAM = {
    0.001: ((1.0367, -0.9290, 0.9200, -0.8337, 0.8159), (1.0040, -0.9801, 0.9882, -0.9644, 0.9726)),
    0.01: ((1.1235, -0.7080, 0.7312, -0.4015, 0.4378), None),
}
"""D_n = nu L/(a r^2): pressure over rho a V_0 at t = 1, 3, 5, 7, 9 L/a; with steady friction instead."""

Given = Callable[[float], float]


class Ticked:
    """A transmission line stepped over ticks, its ends prescribed; flows taken in by Gauss quadrature of two points."""

    def __init__(self, kind: str, fluid: SimpleOil, at_a: Given, at_b: Given, **values: Any) -> None:
        self.line: Any = FORMS[kind](**values)
        self.names, self.given = (f"{kind[0]}_a", f"{kind[1]}_b"), (at_a, at_b)
        self.world: dict[str, Any] = {item.name: np.zeros(1) for item in self.line.declared(State)}
        scalars = set(self.world)
        for item in self.line.declared(Held):
            self.world[item.name] = self.line.start_of(item, fluid)
            scalars |= set() if item.size else {item.name}
        symbols = {n: _symbol(n, () if n in scalars else (len(v),)) for n, v in self.world.items()}
        symbols |= {n: _symbol(n, ()) for n in (*self.names, "t")}
        returned = self.line.equations(**symbols, fluid=fluid)
        tick = returned.pop("tick_over")
        returned = {n: value for n, value in returned.items() if not isinstance(value, (Event, Failure))}
        self.dt = float(ca.evalf(Sym.of(tick.dt).sx))
        self._order = list(symbols)
        self._seen = _compiled(symbols, returned)
        self._tick = _compiled(symbols, tick.then)
        self.ticks = 0

    def at(self, t: float) -> dict[str, float]:
        """Pressures and flows at both ends, and the content, at t since the start, within the tick that now runs."""
        values = self._call(self._seen, t)
        found = {name: float(value[0]) for name, value in values.items()}
        return found | {name: given(t) for name, given in zip(self.names, self.given, strict=True)}

    def step(self) -> None:
        """One tick."""
        start = self.ticks * self.dt
        for node in (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5):
            now = self._call(self._seen, start + node * self.dt)
            for end in ("a", "b"):
                self.world[f"into_{end}"] = self.world[f"into_{end}"] + self.dt / 2 * now[f"der_into_{end}"]
        self.ticks += 1
        self.world |= self._call(self._tick, self.ticks * self.dt)

    def _call(self, function: ca.Function, t: float) -> dict[str, np.ndarray]:
        ends = {name: given(t) for name, given in zip(self.names, self.given, strict=True)}
        world = self.world | ends | {"t": t}
        values = function.call([world[name] for name in self._order])
        return {n: v.full()[:, 0] for n, v in zip((o[4:] for o in function.name_out()), values, strict=True)}


def _symbol(name: str, shape: tuple[int, ...]) -> Sym:
    return Sym(ca.SX.sym(name, *shape) if shape else ca.SX.sym(name), shape)


def _compiled(symbols: dict[str, Sym], returned: dict[str, Any]) -> ca.Function:
    outputs = {f"new_{name}": Sym.of(value).sx for name, value in returned.items()}
    return ca.Function("f", [s.sx for s in symbols.values()], list(outputs.values()), list(symbols), list(outputs))


def slam_oil(number: float, length: float, radius: float) -> SimpleOil:
    """The oil whose D_n in the line is ``number``."""
    nu = number * WAVE_SPEED * radius**2 / length
    return SimpleOil(density=870.0, kinematic_viscosity=nu, bulk_modulus=1.6e9)


def slam_by_ticks(number: float, lumps: int, terms: int) -> list[float]:
    """Pressure at the valve over rho a V_0, V_0 = 1 mm/s, at 1, 3, 5, 7, 9 L/a."""
    length, radius, v = 10.0, 5e-3, 1e-3
    oil, area = slam_oil(number, length, radius), np.pi * radius**2
    run = Ticked(
        "pq", oil, lambda t: 0.0, lambda t: 0.0, length=length, diameter=2 * radius, mean_pressure=0.0, lumps=lumps,
        friction_terms=terms, start_flow=v * area,
    )  # fmt: skip
    steady = -8 * oil.viscosity * 870.0 * length * v / radius**2
    found = []
    for _ in range(5):
        for _ in range(2 * lumps * (1 if not found else 2)):
            run.step()
        found.append((float(run.world["sent_b"][0]) - steady) / (870.0 * WAVE_SPEED * v))  # q_b = 0: p = w
    return found


def slam_exact(number: float) -> list[float]:
    """The same by the exact two-port: Fourier inversion of Z_in(s)/s along a line right of the axis.

    Damping 0.8 over a period of 20 L/a folds 1e-7 back; the highest of 2^15 frequencies are faded by a Gaussian, which
    blurs fronts over 1e-3 L/a.
    """
    length, radius, damping, period, count = 10.0, 5e-3, 0.8, 20.0, 2**15
    oil, area = slam_oil(number, length, radius), np.pi * radius**2
    line = DistributedLineTakesGives(length=length, diameter=2 * radius)
    k = np.arange(count)
    s = damping + 2j * np.pi * k / period
    s[0] += 1e-9j
    scaled = s * WAVE_SPEED / length
    inside = 1 / line.two_port(-1j * scaled, 0.0, 0.0, oil)[:, 1, 1]
    image = inside * area / (870.0 * WAVE_SPEED) / s * np.exp(-0.5 * (5 * k / count) ** 2)
    image[1:] *= 2
    return [float(np.exp(damping * t) / period * np.sum(image * np.exp(2j * np.pi * k * t / period)).real)
            for t in (1, 3, 5, 7, 9)]  # fmt: skip


def _numbers(title: str, expected: Any, computed: list[float]) -> list[Number]:
    times = (1, 3, 5, 7, 9)
    return [Number(f"{title}, {t} L/a", e, c, size=1.0) for t, e, c in zip(times, expected, computed, strict=True)]


@evidence(
    "transmission_line",
    "distributed_line",
    source="laminar valve slam with Zielke's friction: Fourier inversion of the exact line, as Zielke (1968)",
    tolerance=6e-5,
    because="the expected values are rounded to four digits",
)
def slam_by_two_port() -> list[Number]:
    """Valve slam by the exact two-port: pressure over rho a V_0 from the steady value, at mid-plateaus."""
    return [n for d, (exact, _) in SLAM.items() for n in _numbers(f"D_n {d:g}", exact, slam_exact(d))]


@evidence(
    "transmission_line",
    source="laminar valve slam with Zielke's friction, as by the two-port",
    tolerance=1.1e-2,
    because="behind a front the friction falls as t^-1/2, 2 sqrt(D_n/(pi t)) of rho a V_0 over the line, and the "
    "midpoint rule over 20 lumps, 2/20 L/a apart in their echoes, errs by 0.605 sqrt(D_n/pi) sqrt(2/20) = 1.1e-2 at "
    "D_n 0.01; the ramp of each tick averages some of it",
)
def slam_by_delay() -> list[Number]:
    """Valve slam by ticks, 20 lumps of friction with ten terms of Kagawa's fit."""
    found = []
    for d, (exact, _) in SLAM.items():
        found += _numbers(f"D_n {d:g}", exact, slam_by_ticks(d, 20, MOST_TERMS))
    return found


@evidence(
    "transmission_line",
    source="laminar valve slam with steady friction, characteristics of the telegraph equation",
    tolerance=1e-4,
    because="the expected values are rounded to four digits; 20 lumps",
)
def slam_with_steady_friction() -> list[Number]:
    """Valve slam with the friction of steady flow alone, D_n 0.001."""
    return _numbers("D_n 0.001", SLAM[0.001][1], slam_by_ticks(0.001, 20, 0))


@evidence(
    "transmission_line",
    source="Joukowsky (1898), by hand: 870 kg/m^3 * 1356.127 m/s * 1 m/s",
    tolerance=4.3e-5,
    because="11.798 is rounded to five digits, half a unit of the last is 4.2e-5",
)
def joukowsky() -> list[Number]:
    """Stopping 1 m/s at once in a rigid line, 870 kg/m^3, 1.6 GPa."""
    area, thin = np.pi * 0.01**2, SimpleOil(density=870.0, kinematic_viscosity=1e-12, bulk_modulus=1.6e9)
    size: dict[str, Any] = {"length": 10.0, "diameter": 0.02, "mean_pressure": 0.0}
    run = Ticked("pq", thin, lambda t: 0.0, lambda t: 0.0, **size, start_flow=area)
    before = -float(run.world["drop"].sum())
    return [
        Number("pressure rise", 11.798e5, run.at(0.5 * run.dt)["p_b"] - before, "bar"),
        Number("delay L/a, s", 10.0 / 1356.127, run.dt * run.line.cells),
    ]
