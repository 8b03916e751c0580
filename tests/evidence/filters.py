"""Filters."""

from __future__ import annotations

from crescentlab.components.filters import Filter
from crescentlab.components.fluids import SimpleOil

from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60


@evidence(
    "filter",
    source="how makers carry ISO 3968 curves over: element with density and viscosity, housing with density; by hand",
    tolerance=1e-7,
    because="the sums by hand are exact; the fluid's density varies by 1e-9",
)
def carried_over() -> list[Number]:
    """Element 0.02 bar/(L/min), housing 1.5e-4 bar/(L/min)^2 with 860 kg/m^3 and 30 cSt: drops of 30 L/min."""
    element, housing = 0.02 * BAR / LPM, 1.5e-4 * BAR / LPM**2
    cases = {
        "reference oil, 0.6 + 0.135 bar": (860.0, 30e-6, 1.0, 0.735),
        "half the viscosity, 0.3 + 0.135 bar": (860.0, 15e-6, 1.0, 0.435),
        "nine tenths of the density, 0.54 + 0.1215 bar": (774.0, 30e-6, 1.0, 0.6615),
        "clogged tenfold, 6 + 0.135 bar": (860.0, 30e-6, 10.0, 6.135),
    }
    found = []
    for what, (rho, nu, clogging, drop) in cases.items():
        part = Filter(element=element, housing=housing, clogging=clogging)
        oil = SimpleOil(density=rho, kinematic_viscosity=nu, bulk_modulus=1e15)
        found.append(Number(what, 30 * LPM, part.equations(p_a=drop * BAR, p_b=0.0, fluid=oil)["q"], "L/min"))
    return found
