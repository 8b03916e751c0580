"""Laws of fluids."""

from __future__ import annotations

import math

from building import circuit
from crescentlab.components.cavitating_fluids import CavitatingOil, MineralOil, Water
from crescentlab.components.fluids import AeratedOil, SimpleOil
from crescentlab.components.viscosity_laws import walther_viscosity, wooster_coefficient

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
    "ISO VG 32": (100, 47.31, 32.37),
    "ISO VG 46": (100, 71.29, 45.33),
    "ISO VG 68": (100, 113.9, 66.48),
    "SAE 15W-40": (140, 286.4, 145.3),
    "ATF": (176, 82.39, 50.69),
}
"""Viscosity index; L and H [cSt] of ASTM D2270, Table 1, for the grade's viscosity at 100 degC."""


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
    source="viscosity index of hydraulic oils without improver, 95 to 105, and as the data sheets of Mobil Delvac MX "
    "15W-40 and Mobil Multipurpose ATF (Dexron III) state it; by ASTM D2270 from the law's viscosities",
    tolerance=0.05,
    because="oils of one grade differ by as much",
)
def indices() -> list[Number]:
    """Viscosity index of the grades."""
    return [
        Number(grade, index, viscosity_index(viscosity(grade, 40), viscosity(grade, 100), L, H))
        for grade, (index, L, H) in TYPICAL.items()
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
    source="ASTM D341, worked example of a public calculator (olezol.com): 404 cSt at 40 degC and 28 cSt at 100 degC "
    "are 132.126 cSt at 60 degC",
    tolerance=1e-5,
    because="the example has six digits",
)
def chart() -> list[Number]:
    """Gear oil SAE 140 on the viscosity chart."""
    nu = walther_viscosity(CELSIUS + 60, CELSIUS + 40, 404 * CST, CELSIUS + 100, 28 * CST)
    return [Number("viscosity at 60 degC", 132.126 * CST, nu, "cSt")]


MEASURED = (
    ("heavy machine oil", 153, 34, 9.1, 20.5),
    ("heavy machine oil", 250, 50.5, 12.6, 21.3),
    ("cylinder oil", 810, 135, 26.8, 28),
    ("spindle oil", 18.6, 6.3, 2.4, 16),
    ("light machine oil", 45, 12, 3.9, 20),
    ("medicinal white oil", 107, 23.3, 6.4, 22.8),
    ("heavy machine oil", 122, 26.3, 7.3, 21.6),
    ("heavy machine oil", 171, 31, 7.5, 23),
    ("spindle oil", 30.7, 8.6, 3.1, 20.3),
    ("heavy machine oil", 165, 30.0, 6.8, 23.8),
    ("heavy machine oil", 310, 44.2, 9.4, 26.3),
    ("cylinder oil", 2000, 180, 24, 29.4),
)
"""Dynamic viscosity [mPa s] at 30, 60 and 100 degC, pressure-viscosity coefficient [1/GPa] at 60 degC; the mineral oils
of the table whose row is complete, all but the first."""


@evidence(
    "mineral_oil",
    source="measured oils in Stachowiak & Batchelor, Engineering Tribology, Table 2.3",
    tolerance=0.06,
    because="the line of ASTM D341 through 30 and 100 degC leaves a measured oil by some per cent; densities by "
    "API MPMS 11.1 from 880 kg/m^3",
)
def measured_viscosities() -> list[Number]:
    """Viscosity at 60 degC from those at 30 and 100 degC."""
    found = []
    rho = [880 * math.exp(-a * (1 + 0.8 * a)) for a in (0.6278 / 880 * (t - 15) for t in (30, 60, 100))]
    for name, *mu, _ in MEASURED:
        thick, thin = mu[0] * 1e-3 / rho[0], mu[2] * 1e-3 / rho[2]
        nu = walther_viscosity(CELSIUS + 60, CELSIUS + 30, thick, CELSIUS + 100, thin)
        found.append(Number(f"{name}, {mu[0]:g} mPa s at 30 degC", mu[1] * 1e-3 / rho[1], nu, "cSt"))
    return found


@evidence(
    "mineral_oil",
    source="measured oils in Stachowiak & Batchelor, Engineering Tribology, Table 2.3",
    tolerance=0.3,
    because="Wooster's is a correlation of the viscosity alone, made of other oils",
)
def pressure_coefficients() -> list[Number]:
    """Pressure-viscosity coefficient at 60 degC from the viscosity there."""
    return [
        Number(f"{name}, {mu:g} mPa s at 60 degC", alpha * 1e-9, wooster_coefficient(mu * 1e-3), "1/GPa")
        for name, _, mu, _, alpha in MEASURED
    ]


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


@evidence(
    "water",
    source="IAPWS-95 at constant entropy from 1 atm, computed with a public implementation",
    tolerance=1e-4,
    because="the bulk modulus is right to 0.25 %, and compression takes 1 % off the volume at 500 bar",
)
def enthalpy_of_water() -> list[Number]:
    """Enthalpy of 1 kg at 200 and 500 bar over that at 0 bar gauge, of water that starts at 20 and at 60 degC."""
    known = ((20, 200, 19946.48), (20, 500, 49547.75), (60, 200, 20257.64), (60, 500, 50344.30))
    return [
        Number(f"{t} degC, {p} bar", w, Water(temperature=CELSIUS + t).enthalpy(p * BAR), "kJ") for t, p, w in known
    ]


@evidence(
    "water",
    source="IAPWS-95 at constant entropy from 1 atm, rho w - p, computed with a public implementation",
    tolerance=2.5e-3,
    because="as good as the bulk modulus, whose rise is taken as linear",
)
def energy_of_water() -> list[Number]:
    """What a litre of water stores by its pressure, from 20 degC at 0 bar gauge on."""
    known = ((200, 88.194), (500, 524.894))
    return [Number(f"at {p} bar", e, Water().energy_density(p * BAR) * 1e-3, "J") for p, e in known]


@evidence(
    "aerated_oil",
    "cavitating_oil",
    "mineral_oil",
    source="work of polytropic compression of the air, a over the liquid's volume, and of an incompressible liquid",
    tolerance=1e-6,
    because="the absolute pressure of the air is rounded by (P_min/P)^2, 1e-6 at 0 bar",
)
def enthalpy_of_air() -> list[Number]:
    """rho_l w at 10 bar gauge, 20 % of air that does not dissolve: p + a P_atm n/(n - 1) [(P/P_atm)^(1 - 1/n) - 1]."""
    air = {"air_fraction": 0.2, "saturation_pressure": 1e15, "bulk_modulus": 1e15}
    stiff, found = {**LIQUID, **air}, []
    for n, work in ((1.0, math.log1p(1e6 / ATM)), (1.4, 3.5 * math.expm1(math.log1p(1e6 / ATM) / 3.5))):
        index = {"polytropic_index": n}
        for oil in (
            AeratedOil(**stiff, **index),
            CavitatingOil(**stiff, **index, vapour_pressure=500.0),
            MineralOil(grade="ISO VG 46", **air, **index),
        ):
            name = f"{snake_case(type(oil).__name__)}, n = {n:g}"
            found.append(Number(name, 1e6 + 0.25 * ATM * work, oil.enthalpy(1e6) * oil.rho_0 / 0.8, "bar"))
    return found


@evidence(
    "simple_oil",
    source="energy in a compressed liquid, p^2/(2 beta)",
    tolerance=1e-4,
    because="the next term is p/(3 beta), 1e-4 at 4.2 bar",
)
def energy_of_oil() -> list[Number]:
    """What a litre stores at 1 and 4 bar, 14 000 bar."""
    oil = SimpleOil(**LIQUID, bulk_modulus=1.4e9)
    return [Number(f"at {p} bar", (p * BAR) ** 2 / 2.8e12, oil.energy_density(p * BAR) * 1e-3, "J") for p in (1, 4)]
