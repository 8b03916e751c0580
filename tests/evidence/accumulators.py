"""Accumulators and separators."""

from __future__ import annotations

import math

from building import OIL, circuit
from crescentlab.components.accumulators import GasAccumulator
from crescentlab.components.fluids import SimpleOil
from scipy.optimize import brentq

from evidence import Number, evidence

BAR, ATM = 1e5, 101325.0
RIGID = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1e25)


@evidence(
    "gas_accumulator",
    source="polytropic law p V^n = const. and its integral, p_0 V_0 ln(V_0/V) for n = 1",
    tolerance=1e-9,
    because="rounding; the oil is rigid here",
)
def gas() -> list[Number]:
    """Gas volume and energy of 1 L at 90 bar gauge, compressed to 180 bar: isothermal and adiabatic."""
    found = []
    for n in (1.0, 1.4):
        values = GasAccumulator(volume=1e-3, preload=90 * BAR, polytropic_index=n).equations(
            p=180 * BAR, q_port=0.0, fluid=RIGID
        )
        low, high = 90 * BAR + ATM, 180 * BAR + ATM
        volume = 1e-3 * (low / high) ** (1 / n)
        work = low * 1e-3 * math.log(1e-3 / volume) if n == 1 else (high * volume - low * 1e-3) / (n - 1)
        found += [
            Number(f"gas volume, n = {n:g}", volume, values["gas_volume"], "cm3"),
            Number(f"energy, n = {n:g}", work - ATM * (1e-3 - volume), values["energy"], "J"),
        ]
    return found


@evidence(
    "gas_accumulator",
    source="power of the flow, integral of p q dt, equals the work done on the gas (first law), for a rigid fluid",
    tolerance=1e-6,
    because="relative tolerance of the run and of the integral over its steps",
)
def charging() -> list[Number]:
    """1 L of gas at 90 bar charged with 12 L/min for 2 s: pressure P_0 (V_0/(V_0 - q t))^n, and the pump's work."""
    parts = {
        "pump": {"type": "flow_source", "flow": "12 L/min"},
        "store": {"type": "gas_accumulator", "volume": "1 L", "preload": "90 bar", "start": {"p": "90 bar"}},
    }
    fluid = {**OIL, "bulk_modulus": "1e9 GPa"}
    run = circuit(
        components=parts, nets={"n": ["pump.port", "store.port"]}, fluid=fluid, simulation={"stop": "2 s"}
    ).simulate(rtol=1e-10, output_step="1 ms")
    t, p = run.time, run["store.p"]
    simpson = float(sum((t[k + 2] - t[k]) / 6 * (p[k] + 4 * p[k + 1] + p[k + 2]) for k in range(0, len(t) - 2, 2)))
    return [
        Number("pressure", (90 * BAR + ATM) * (1 / 0.6) ** 1.4 - ATM, float(p[-1]), "bar"),
        Number("work of the pump", 2e-4 * simpson, float(run["store.energy"][-1]), "J"),
    ]


@evidence(
    "piston_separator",
    source="bulk modulus of two volumes of liquid that share a pressure, p = q t/(V_a/beta_a + V_b/beta_b)",
    tolerance=1e-3,
    because="terms of second order: p/beta is 6e-4 at the end",
)
def in_series() -> list[Number]:
    """Oil, 14 000 bar, and water, 22 000 bar, 110 cm^3 each, 6 L/min for 1 ms: q t/(V_a/beta_a + V_b/beta_b)."""
    water = {
        "type": "simple_oil",
        "density": "1000 kg/m^3",
        "kinematic_viscosity": "1 cSt",
        "bulk_modulus": "22000 bar",
    }
    parts = {
        "pump": {"type": "flow_source", "flow": "6 L/min"}, "end": {"type": "plug"},
        "piston": {"type": "piston_separator", "volume": "200 cm^3"},
    }  # fmt: skip
    nets = {
        "oil_side": {"fluid": "oil", "ports": ["pump.port", "piston.a"]},
        "water_side": {"fluid": "water", "ports": ["piston.b", "end.port"]},
    }
    run = circuit(
        components=parts, nets=nets, fluids={"oil": OIL, "water": water}, simulation={"stop": "1 ms"}
    ).simulate()
    expected = 1e-7 / (110e-6 / 1.4e9 + 110e-6 / 2.2e9)
    return [
        Number("pressure of the oil", expected, float(run["piston.pressure_a"][-1]), "bar"),
        Number("pressure of the water", expected, float(run["piston.pressure_b"][-1]), "bar"),
        Number("volume given up by the water", expected / 2.2e9 * 110e-6, float(run["piston.V_a"][-1]) - 110e-6, "mm3"),
    ]


@evidence(
    "gas_accumulator",
    source="first law: adiabatic gas gives back what compressed it; P_0 V_0 ((V_0/V)^0.4 - 1)/0.4 less the "
    "atmosphere's, and 25 cm^3 at first, 420 at last, of oil with e(p) = beta (exp(p/beta) - 1) - p",
    tolerance=1e-8,
    because="relative tolerance of the run, 1e-9; oil in and out as sine, so that its integral is exact",
)
def given_back() -> list[Number]:
    """1 L at 90 bar charged with 0.4 L of oil and discharged, in 2 s: energy stored, and work left over, 0."""
    parts = {
        "law": {"type": "sine", "amplitude": "37.69911184307752 L/min", "frequency": "0.5 Hz"},
        "pump": {"type": "signal_flow_source"},
        "store": {"type": "gas_accumulator", "volume": "1 L", "preload": "90 bar", "dead_volume": "25 cm^3",
                  "start": {"p": "90 bar"}},
    }  # fmt: skip
    nets = {"s": ["law.y", "pump.flow"], "n": ["pump.port", "store.port"]}
    work = []
    for stop in ("1 s", "2 s"):
        run = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": stop}).simulate(
            solver="radau", rtol=1e-9
        )
        assert run.balance is not None
        assert run.balance.energy is not None
        work.append(sum(run.balance.energy.supplied.values()))
    beta, low = 1.4e9, 90 * BAR + ATM

    def oil(p: float) -> float:
        return beta * math.expm1(p / beta) - p

    def full(p: float) -> float:
        gas = 1e-3 * (low / (p + ATM)) ** (1 / 1.4)
        return (1.025e-3 - gas) * math.exp(p / beta) - 25e-6 * math.exp(90 * BAR / beta) - 0.4e-3

    p = float(brentq(full, 90 * BAR, 400 * BAR, rtol=1e-14))
    gas = 1e-3 * (low / (p + ATM)) ** (1 / 1.4)
    compressed = low * 1e-3 * ((1e-3 / gas) ** 0.4 - 1) / 0.4 - ATM * (1e-3 - gas)
    stored = compressed + (1.025e-3 - gas) * oil(p) - 25e-6 * oil(90 * BAR)
    return [Number("charged", stored, work[0], "J"), Number("left over", 0.0, work[1], "J", size=stored)]
