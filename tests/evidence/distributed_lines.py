"""The distributed line, and the friction and walls that it shares with the transmission line."""

from __future__ import annotations

from typing import Any

import numpy as np
from crescentlab.components.distributed_lines import (
    DistributedLine,
    DistributedLineGivesGives,
    DistributedLineTakesGives,
    DistributedLineTakesTakes,
)
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.frequency_friction import MOST_TERMS, RATES, WEIGHTS, added_inertia, lag_loss, moving
from crescentlab.components.two_ports import inertia_factor
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar
from scipy.special import jn_zeros, jv

from evidence import Number, evidence

OIL = SimpleOil(density=870.0, kinematic_viscosity=46e-6, bulk_modulus=1.6e9)
THIN = SimpleOil(density=870.0, kinematic_viscosity=1e-12, bulk_modulus=1.6e9)
WATER = SimpleOil(density=1000.0, kinematic_viscosity=1e-6, bulk_modulus=2.1e9)
LINE: dict[str, Any] = {"length": 2.0, "diameter": 0.01}
CLOSED_MODE = np.sqrt(1.6e9 / 870) / (4 * LINE["length"])  # a/4L [Hz]


def rates(line: DistributedLine, x: np.ndarray, ends: tuple[float, float], fluid: SimpleOil) -> np.ndarray:
    """dx/dt of all states, in the order pressures, flows, lagging flows; ends: what each receives."""
    p, q, lag = np.split(x, np.cumsum([line.pressures, line.flows]))
    given = {port.inputs()[0][0]: value for port, value in zip(line.ports(), ends, strict=True)}
    found = line.equations(p_node=p, q_node=q, q_lag=lag, **given, fluid=fluid)
    return np.concatenate([np.asarray(found[f"der_{n}"]) for n in ("p_node", "q_node", "q_lag")])


def linear(line: DistributedLine, fluid: SimpleOil) -> tuple[np.ndarray, np.ndarray]:
    """A and B of the line at rest, by central differences of its equations on floats: 1 kPa or 1e-9 m^3/s."""
    size = np.repeat([1e3, 1e-9, 1e-9], [line.pressures, line.flows, line.lagging])
    ends = np.diag([1e-9 if port.role == "gives" else 1e3 for port in line.ports()])
    rest = np.zeros(size.size)

    def slope(x: np.ndarray, end: np.ndarray, step: float) -> np.ndarray:
        up, down = (rates(line, s * x, tuple(s * end), fluid) for s in (1.0, -1.0))
        return (up - down) / (2 * step)

    A = np.column_stack([slope(size[k] * unit, np.zeros(2), size[k]) for k, unit in enumerate(np.eye(size.size))])
    B = np.column_stack([slope(rest, end, end.sum()) for end in ends])
    return A, B


def frequencies(A: np.ndarray) -> np.ndarray:
    """Frequencies [Hz] of the oscillations of a linear system, lowest first."""
    found = np.sort(np.linalg.eigvals(A).imag) / (2 * np.pi)
    return found[found > 1e-3 * found[-1]]


def peak(gain: Any, low: float, high: float) -> tuple[float, float]:
    """Frequency [Hz] and height of a resonance between low and high."""
    found = minimize_scalar(lambda f: -gain(f), bounds=(low, high), method="bounded", options={"xatol": 1e-5})
    return float(found.x), -float(found.fun)


def exact_gain(line: Any, fluid: SimpleOil) -> Any:
    """|p_b/p_a| over f [Hz] with end b blocked, by the line's own two-port."""

    def gain(f: float) -> float:
        Y = line.two_port(np.array([2 * np.pi * f]), 0.0, 0.0, fluid)
        return float(np.abs(Y[0, 1, 0] / Y[0, 1, 1]))

    return gain


def lumped_gain(line: DistributedLine, fluid: SimpleOil) -> Any:
    """|p_b/p_a| over f [Hz] with end b blocked, of the cells' linear model."""
    A, B = linear(line, fluid)
    poles, vectors = np.linalg.eig(A)
    weights = vectors[line.pressures - 1] * np.linalg.solve(vectors, B[:, 0])
    return lambda f: float(abs(np.sum(weights / (2j * np.pi * f - poles))))


@evidence(
    "distributed_line",
    source="wave speed of Joukowsky (1898), by hand: sqrt(1.6e9/870) m/s",
    tolerance=1e-6,
    because="the expected value is rounded to seven digits",
)
def joukowsky() -> list[Number]:
    """Rigid line, 870 kg/m^3, 1.6 GPa: wave speed at 0 bar."""
    line = DistributedLineTakesTakes(**LINE)
    rest: Any = 0.0
    return [Number("wave speed, m/s", 1356.127, float(line.wave_speed(rest, 0.01, OIL)))]


@evidence(
    "distributed_line",
    source="sin(x)/x, x = pi/4N, of a staggered grid; with full end cells 2N (2/pi) sin(pi/(4N + 2)), a ladder of N "
    "equal sections (Rayleigh, Theory of Sound, section 120)",
    tolerance=2e-5,
    because="the expected values are rounded to five and four digits; the viscosity left is 1e-12 m^2/s",
)
def closed_end_mode() -> list[Number]:
    """First mode of 10 cells, one end at constant pressure, one closed, over a/4L."""
    A, _ = linear(DistributedLineGivesGives(**LINE, cells=10), THIN)
    held = A[1:, 1:]  # the pressure at a, half a cell, does not move
    full = held.copy()
    full[9] /= 2  # what a full cell at b would do
    unlike, _ = linear(DistributedLineTakesGives(**LINE, cells=10), THIN)
    return [
        Number("half cells at both ends", 0.99897, frequencies(held)[0] / CLOSED_MODE),
        Number("a full cell at the closed end", 0.9515, frequencies(full)[0] / CLOSED_MODE),
        Number("half a cell at b, half an inertia at a", np.sinc(1 / 42), frequencies(unlike)[0] / CLOSED_MODE),
    ]


@evidence(
    "distributed_line",
    source="D'Souza & Oldenburger (1964), blocked end: 1/cosh(Gamma l), Gamma with Zielke's friction",
    tolerance=4.2e-4,
    because="12.18 is rounded to four digits, half a unit of the last is 4.1e-4",
)
def blocked_end() -> list[Number]:
    """Resonances of a blocked line, 2 m, 10 mm, 46 cSt, 870 kg/m^3, 1.6 GPa, by the exact two-port."""
    gain = exact_gain(DistributedLineTakesGives(**LINE), OIL)
    (f_1, g_1), (f_2, g_2) = peak(gain, 140, 190), peak(gain, 450, 540)
    return [
        Number("first resonance", 164.54, f_1, "Hz"),
        Number("its gain", 20.71, g_1),
        Number("second resonance", 499.92, f_2, "Hz"),
        Number("its gain", 12.18, g_2),
    ]


@evidence(
    "distributed_line",
    source="the exact two-port of the same line, as above",
    tolerance=1e-2,
    because="10 cells put the second mode (pi f dx/a)^2/6 = 0.8 % low, 20 cells a quarter of it; Kagawa's fit "
    "changes gains by 1e-3",
)
def blocked_end_in_cells() -> list[Number]:
    """The same resonances of the cells with frequency-dependent friction, over the number of cells."""
    found = []
    for cells in (10, 20):
        gain = lumped_gain(DistributedLineTakesGives(**LINE, cells=cells, friction_terms=MOST_TERMS), OIL)
        for (f, g), low, high in (((164.54, 20.71), 140, 190), ((499.92, 12.18), 450, 540)):
            f_c, g_c = peak(gain, low, high)
            found += [Number(f"{f} Hz by {cells} cells", f, f_c, "Hz"), Number("its gain", g, g_c)]
    return found


@evidence(
    "distributed_line",
    source="1/cosh(Gamma l) with steady laminar friction, 32 nu/d^2: 169.5 Hz, gain 92",
    tolerance=3e-3,
    because="the expected values are rounded to four and two digits; 20 cells are 3e-4 slow",
)
def blocked_end_with_steady_friction() -> list[Number]:
    """The same line with friction of steady flow alone, which damps too little, by 20 cells."""
    f, g = peak(lumped_gain(DistributedLineTakesGives(**LINE, cells=20), OIL), 140, 190)
    return [Number("first resonance", 169.5, f, "Hz"), Number("its gain", 92.0, g)]


@evidence(
    "distributed_line",
    "transmission_line",
    source="Zielke (1968): W = sum of exp(-zeta^2 tau) over the zeros of J_2, here 20000 of SciPy's",
    tolerance=3.1e-3,
    because="the fit of ten terms is published as good from tau = 1e-5 on; 3.0e-3 is its largest error there",
)
def weighting_function() -> list[Number]:
    """Kagawa's ten terms for Zielke's weighting function W(tau)."""
    zeros, found = jn_zeros(2, 20000), []
    for tau in (1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 5e-2, 0.1):
        fit = sum(m * np.exp(-n * tau) for m, n in zip(WEIGHTS, RATES, strict=True))
        found.append(Number(f"W({tau:g})", float(np.exp(-(zeros**2) * tau).sum()), float(fit)))
    return found


@evidence(
    "distributed_line",
    "transmission_line",
    source="Zielke (1968): I_0(sqrt(w))/I_2(sqrt(w)), w = j omega R^2/nu",
    tolerance=5e-4,
    because="times shorter than the last term's, R^2/nu/348316, stand as inertia, of other phase than friction; from "
    "there on, omega R^2/nu = 3e5, friction is 1/sqrt of that or 2e-3 of the inertia, and a quarter of it differs",
)
def friction_factor() -> list[Number]:
    """Inertia with friction over inertia alone, real and imaginary, of ten terms and the inertia for what they lack."""
    found = []
    for size in (0.1, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6):
        w = 1j * size
        terms = sum(m / (w + n) for m, n in zip(WEIGHTS, RATES, strict=True))
        fit = 1 + 8 / w + 4 * terms + added_inertia(MOST_TERMS)
        exact = complex(inertia_factor(np.array([w]))[0])
        found.append(Number(f"omega R^2/nu = {size:g}, real", exact.real, fit.real, size=abs(exact)))
        found.append(Number(f"omega R^2/nu = {size:g}, imaginary", exact.imag, fit.imag, size=abs(exact)))
    return found


@evidence(
    "distributed_line",
    "transmission_line",
    source="Lame's cylinder: inner radius grows by u = (p R/E) ((r_o^2 + R^2)/(r_o^2 - R^2) + mu) (Timoshenko & "
    "Goodier, Theory of Elasticity, section 28); thin wall: Korteweg (1878), a = sqrt(K/rho)/sqrt(1 + K d/(E e))",
    tolerance=2e-3,
    because="closed forms; a wall of d/e = 1000 is thin to 1e-3",
)
def elastic_wall() -> list[Number]:
    """Wave speed in water, 2.1 GPa, in steel, 210 GPa, Poisson's ratio 0.3, with expansion joints."""
    rest: Any = 0.0

    def speed(thickness: float) -> float:
        line = DistributedLineTakesTakes(length=10.0, diameter=0.1, wall_thickness=thickness, youngs_modulus=210e9)
        return float(line.wave_speed(rest, 0.1, WATER))

    def lame(thickness: float) -> float:
        inner, outer = 0.05, 0.05 + thickness
        growth = 2 / 210e9 * ((outer**2 + inner**2) / (outer**2 - inner**2) + 0.3)
        return float(1 / np.sqrt(1000.0 * (1 / 2.1e9 + growth)))

    thin = np.sqrt(2.1e9 / 1000) / np.sqrt(1 + 2.1e9 * 0.1 / (210e9 * 1e-4))
    return [
        Number("10 mm wall, 100 mm bore, m/s", lame(0.01), speed(0.01)),
        Number("50 mm wall, m/s", lame(0.05), speed(0.05)),
        Number("0.1 mm wall, m/s", float(thin), speed(1e-4)),
    ]


@evidence(
    "distributed_line",
    source="the parabola's 1/2 rho integral of u^2 dA = 4/3 of 1/2 rho A v^2; in oscillation 1/2 rho |u|^2 and "
    "mu |du/dr|^2 of the profile of J. R. Womersley, J. Physiol. 127 (1955) 553-563, integrated over the bore",
    tolerance=3.1e-3,
    because="3.0e-3 is the largest error of Kagawa's fit for W",
)
def laminar_energy() -> list[Number]:
    """Energy of the motion over that of a flat profile, and heat over that of steady flow, means over a period."""
    steady = moving(1.0, [1.0] * MOST_TERMS, MOST_TERMS)
    found, diameter, rest, nu = [Number("energy in steady flow", 4 / 3, steady)], 0.02, np.zeros(1), 46e-6
    for size in (1.0, 10.0, 1e2, 1e3, 1e4):
        z = 1j**1.5 * np.sqrt(size)
        share = jv(0, z) - 2 * jv(1, z) / z  # of the mean velocity
        energy = quad(lambda y, z=z, n=share: 2 * y * abs((jv(0, z) - jv(0, z * y)) / n) ** 2, 0, 1)[0]
        heat = quad(lambda y, z=z, n=share: y / 4 * abs(z * jv(1, z * y) / n) ** 2, 0, 1)[0]
        lags = [1 / (1 + 1j * size / n) for n in RATES]
        stored, lost = 0.0, 1.0
        for q, turn in ((1.0, 1.0), (0.0, -1j)):  # a quarter of a period apart
            at = [float((u * turn).real) for u in lags]
            stored += moving(q, at, MOST_TERMS)
            lost += float(lag_loss(q, at, rest, diameter, OIL)[0]) * np.pi * diameter**4 / (128 * 870.0 * nu)
        found.append(Number(f"energy at omega R^2/nu = {size:g}", energy, stored))
        found.append(Number(f"heat at omega R^2/nu = {size:g}", heat, lost))
    return found


@evidence(
    "distributed_line",
    source="Joukowsky (1898): all of the motion's energy, 1/4 rho A l v^2, becomes compression, rho a v at the closed "
    "end",
    tolerance=1e-3,
    because="of the order of v/a = 7e-4, the convective term and the change of density by the wave itself",
)
def energy_of_a_quarter_wave() -> list[Number]:
    """First mode of the blocked line in 10 cells, 1 m/s, from all in motion to all at rest, a quarter period later."""
    line = DistributedLineGivesGives(**LINE, cells=10, friction_terms=0)
    area = np.pi / 4 * LINE["diameter"] ** 2
    wave = np.pi / (2 * LINE["length"])
    start = np.concatenate([np.zeros(line.pressures), area * np.cos(wave * 0.2 * (np.arange(10) + 0.5))])
    held = np.array([0.0, *[1.0] * (start.size - 1)])  # the pressure at a does not move

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        return held * rates(line, x, (float(x[line.pressures]), 0.0), THIN)

    def stored(x: np.ndarray) -> float:
        p, q = np.split(x, [line.pressures])
        return float(line.equations(p_node=p, q_node=q, q_lag=q[:0], q_a=0.0, q_b=0.0, fluid=THIN)["stored_energy"])  # type: ignore[arg-type]

    quarter = 1 / (4 * CLOSED_MODE * np.sinc(1 / 40))
    end = solve_ivp(rate, (0, quarter), start, rtol=1e-9, atol=1e-12).y[:, -1]
    still = np.concatenate([end[: line.pressures], np.zeros(line.flows)])
    motion = 870.0 * area * LINE["length"] / 4
    return [
        Number("in motion", motion, stored(start), "J"),
        Number("stored a quarter period later", motion, stored(end), "J"),
        Number("of it in compression", motion, stored(still), "J"),
        Number("pressure at the closed end", 870.0 * np.sqrt(1.6e9 / 870.0), float(end[line.pressures - 1]), "bar"),
    ]
