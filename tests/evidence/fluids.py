"""Laws of fluids."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.cavitating_fluids import CavitatingOil, MineralOil, Water
from crescentlab.components.fluids import AeratedOil, SimpleOil

from crescentlab.component import snake_case
from evidence import Number, evidence

BAR, CST, ATM, CELSIUS = 1e5, 1e-6, 101325.0, 273.15
LIQUID = {"density": 860.0, "kinematic_viscosity": 35e-6}


@evidence(
    "simple_oil",
    source="bulk modulus integrated: rho = rho_0 exp(p/beta); wave speed sqrt(beta/rho)",
    tolerance=1e-6,
    because="the expected wave speed is rounded to seven digits",
)
def wave_speed() -> list[Number]:
    """Density at 1400 bar, and wave speed at 0 bar, of an oil of 870 kg/m^3 and 1.6 GPa."""
    oil = SimpleOil(density=870.0, kinematic_viscosity=1e-5, bulk_modulus=1.6e9)
    return [
        Number("density at 1400 bar", 870 * math.exp(1.4e8 / 1.6e9), oil.density(1.4e8), "kg/m3"),
        Number("wave speed", 1356.127, math.sqrt(oil.bulk_modulus(0.0) / oil.rho_0), "m/s"),
    ]


@evidence(
    "aerated_oil",
    "cavitating_oil",
    source="polytropic law for the air, a over the liquid's volume: beta = (1 + a)/(1/K + a/(n P))",
    tolerance=5e-4,
    because="the expected values are rounded to four digits",
)
def free_air() -> list[Number]:
    """Bulk modulus of oil, 1.7 GPa, with 1 % of air that does not dissolve, n = 1.4, over the absolute pressure."""
    air = {"air_fraction": 0.01, "saturation_pressure": 1e15, "bulk_modulus": 1.7e9}
    found = []
    for oil in (AeratedOil(**LIQUID, **air), CavitatingOil(**LIQUID, **air, vapour_pressure=500.0)):
        for absolute, beta in ((1.01325, 14.07), (5, 192.8), (10, 502.2), (50, 1476.8), (100, 1625.2)):
            name = f"{snake_case(type(oil).__name__)} at {absolute:g} bar absolute"
            found.append(Number(name, beta * 1e6, oil.bulk_modulus(absolute * BAR - ATM), "MPa"))
    return found


@evidence(
    "aerated_oil",
    source="Rundo & Corvaglia (2016), section 6.3 and Fig. 20, by hand",
    tolerance=2e-4,
    because="the expected values are rounded to 1 bar",
)
def oil_of_the_pump() -> list[Number]:
    """Bulk modulus of the paper's oil: 14 000 bar, 0.5 % air dissolving until 1000 bar absolute."""
    oil = AeratedOil(**LIQUID, bulk_modulus=1.4e9, air_fraction=5e-3, saturation_pressure=1e8)
    return [Number(f"at {p} bar", beta * BAR, oil.bulk_modulus(p * BAR), "bar") for p, beta in ((4, 3331), (6, 4994))]


@evidence(
    "cavitating_oil",
    source="conservation of mass: what is drawn leaves vapour behind; Delannoy & Kueny (1990) for its pressure",
    tolerance=1e-4,
    because="relative tolerance 1e-10, 1e-5 Pa, on a range of evaporation of 1000 Pa, times 14 000 bar over 6 bar",
)
def drawn_empty_and_filled() -> list[Number]:
    """100 cm^3 of oil at 5 bar from which a sine of 6 L/min, 5 Hz, draws 6.4 cm^3 and gives them back."""
    fluid = {
        "type": "cavitating_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar",
        "vapour_pressure": "10 mbar",
    }  # fmt: skip
    parts = {
        "law": {"type": "sine", "amplitude": "-6 L/min", "frequency": "5 Hz"}, "pump": {"type": "signal_flow_source"},
        "volume": {"type": "capacity", "volume": "100 cm^3", "start": {"p": "5 bar"}},
    }  # fmt: skip
    nets = {"n": ["pump.port", "volume.port"], "s": ["law.y", "pump.flow"]}

    def run(stop: str) -> float:
        made = circuit(components=parts, nets=nets, fluid=fluid, simulation={"stop": stop, "rtol": "1e-10"})
        return float(made.simulate()["volume.p"][-1])

    left = 100e-6 * math.exp(5 * BAR / 1.4e9) - 2e-4 / (2 * math.pi * 5)
    share = (100e-6 - left) / 100e-6  # of vapour, whose own mass is 2e-5 of the liquid's
    lowest = 1e3 + 500 * 2 / math.pi * math.asin(1 - 2 * share) - ATM
    return [
        Number("lowest pressure", lowest + ATM, run("100 ms") + ATM, "mbar"),
        Number("after the cycle", 5 * BAR + ATM, run("200 ms") + ATM, "bar"),
    ]


TYPICAL = {
    "ISO VG 32": (32.0, 99, 47.31, 32.37),
    "ISO VG 46": (46.0, 98, 71.29, 45.33),
    "ISO VG 68": (68.0, 97, 113.9, 66.48),
    "SAE 15W-40": (109.0, 139, 286.4, 145.3),
}
"""Viscosity [cSt] at 40 degC, viscosity index; L and H [cSt] of ASTM D2270, Table 1, for the viscosity at 100 degC."""


def viscosity_index(at_40: float, at_100: float, L: float, H: float) -> float:
    """ASTM D2270: procedure A up to 100, procedure B above."""
    if at_40 >= H:
        return 100 * (L - at_40) / (L - H)
    return (10 ** ((math.log10(H) - math.log10(at_40)) / math.log10(at_100)) - 1) / 0.00715 + 100


def viscosity(grade: str, celsius: float, p: float = 0.0) -> float:
    """Kinematic viscosity [cSt]."""
    return float(MineralOil(grade=grade, temperature=CELSIUS + celsius).kinematic_viscosity(p)) / CST


@evidence(
    "mineral_oil",
    source="viscosity index that the makers state, by ASTM D2270 from the law's viscosities at 40 and 100 degC",
    tolerance=0.037,
    because="the makers state the viscosity at 100 degC to 0.1 cSt, half of which are up to 3.6 units of the index",
)
def indices() -> list[Number]:
    """Viscosity index of the grades."""
    return [
        Number(grade, index, viscosity_index(viscosity(grade, 40), viscosity(grade, 100), L, H))
        for grade, (_, index, L, H) in TYPICAL.items()
    ]


@evidence(
    "mineral_oil",
    source="ISO 3448: the number of the grade is the viscosity in cSt at 40 degC",
    tolerance=0.1,
    because="ISO 3448 allows 10 %",
)
def grades() -> list[Number]:
    """Viscosity of the ISO grades at 40 degC."""
    return [Number(f"ISO VG {n}", n * CST, viscosity(f"ISO VG {n}", 40) * CST, "cSt") for n in (32, 46, 68)]


@evidence(
    "mineral_oil",
    source="viscosity at 0 degC of the makers' data sheets (Shell Tellus S2 M), not used by the law",
    tolerance=0.05,
    because="extrapolation by 40 K along the line of ASTM D341 from values rounded to 0.1 cSt",
)
def cold() -> list[Number]:
    """Viscosity of the ISO grades at 0 degC."""
    stated = {"ISO VG 32": 338, "ISO VG 46": 580, "ISO VG 68": 1040}
    return [Number(grade, nu * CST, viscosity(grade, 0) * CST, "cSt") for grade, nu in stated.items()]


@evidence(
    "mineral_oil",
    source="ASTM D341, Barus, Hayward (1970) and API MPMS 11.1 by hand, ISO VG 46",
    tolerance=1e-4,
    because="rounding, and 1 bar against absolute zero in the viscosity of the rounded pressure",
)
def vg_46() -> list[Number]:
    """ISO VG 46: viscosity at 60 degC, ratio of viscosities at 300 bar; bulk modulus, density at 40 degC."""
    oil = MineralOil(grade="ISO VG 46", air_fraction=0.0, pressure_viscosity=2e-8)
    ratio = oil.dynamic_viscosity(300 * BAR) / oil.dynamic_viscosity(0.0)
    at_100, at_40 = (math.log10(math.log10(nu + 0.7)) for nu in (6.7, 46.0))
    slope = (at_40 - at_100) / math.log10(373.15 / 313.15)
    at_60 = 10**10 ** (at_40 - slope * math.log10(333.15 / 313.15)) - 0.7
    at_20 = 10**10 ** (at_40 - slope * math.log10(293.15 / 313.15)) - 0.7
    modulus = (1.57 + 0.15 * math.log10(at_20)) * 10 ** (0.0024 * (20 - 40)) * 1e9
    expansion = 0.6278 / 879 * 25
    return [
        Number("viscosity at 60 degC", at_60 * CST, viscosity("ISO VG 46", 60) * CST, "cSt"),
        Number("viscosity at 300 bar over that at 0", math.exp(2e-8 * 300 * BAR), ratio),
        Number("bulk modulus at 0 bar", modulus, oil.bulk_modulus(0.0), "bar"),
        Number("density", 879 * math.exp(-expansion * (1 + 0.8 * expansion)), oil.rho_0, "kg/m3"),
    ]


@evidence(
    "water",
    source="IAPWS-95 and the IAPWS viscosity of 2008, computed with a public implementation of both",
    tolerance=2.5e-3,
    because="the speed of sound is squared, and the rise of the bulk modulus is taken as linear",
)
def water() -> list[Number]:
    """Water at 20 and 60 degC: density, viscosity, wave speed, vapour pressure; at 20 degC and 500 bar."""
    found = []
    for t, rho, nu, c, pv in ((20, 998.207, 1.003395, 1482.346, 2339.32), (60, 983.196, 0.474000, 1550.973, 19946.4)):
        made = Water(temperature=CELSIUS + t)
        found += [
            Number(f"density at {t} degC", rho, made.rho_0, "kg/m3"),
            Number(f"viscosity at {t} degC", nu * CST, made.kinematic_viscosity(0.0), "cSt"),
            Number(f"wave speed at {t} degC", c, math.sqrt(made.bulk_modulus(0.0) / made.rho_0), "m/s"),
            Number(f"vapour pressure at {t} degC", pv, made._vapour()[0], "mbar"),
        ]
    cold = Water()
    return [
        *found,
        Number("density at 500 bar", 1019.924, cold.density(500 * BAR - ATM), "kg/m3"),
        Number("bulk modulus at 500 bar", 2.49876e9, cold.bulk_modulus(500 * BAR - ATM), "GPa"),
    ]
