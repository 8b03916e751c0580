"""Enthalpy and stored energy of every fluid: derivatives, quadrature, closed forms, rounding."""

import math
import re
from decimal import Decimal, localcontext
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from crescentlab.components.cavitating_fluids import CavitatingOil, MineralOil, Water
from crescentlab.components.fluid_laws import absolute_pressure, gauge_pressure, grown
from crescentlab.components.fluids import AeratedOil, SimpleOil
from scipy.integrate import quad
from test_fluids import ALL as FLUIDS
from test_fluids import BAR, OIL, P_ATM

from crescentlab.fluid import Fluid
from crescentlab.maths import TRACER, gauss_legendre, table
from crescentlab.symbols import Sym
from crescentlab.trace import numeric_fields, symbolic_copy

EXTREME = [
    AeratedOil(**OIL, air_fraction="0.5 %", saturation_pressure="1000 bar", polytropic_index=1.0),
    AeratedOil(
        **OIL, air_fraction="10 %", saturation_pressure="1.1 bar", polytropic_index=1e6, dissolution_rounding=0.49
    ),
    AeratedOil(
        **OIL, air_fraction="10 %", saturation_pressure="5000 bar", minimum_pressure="1 Pa", dissolution_rounding=0.49
    ),
    CavitatingOil(**OIL, vapour_pressure="1 mbar", vapour_range=0.9, vapour_density="0.002 kg/m^3"),
    CavitatingOil(**OIL, vapour_pressure="0.6 bar", vapour_range=0.1, vapour_density=20.0, minimum_pressure="30 mbar"),
    Water(temperature="90 degC", vapour_range=0.1, air_fraction="1 %"),
    MineralOil(grade="ISO VG 46", bulk_modulus_rise=1.0),
]
"""Polytropic index at both ends, all of the way to saturation rounded, wide and narrow ranges of evaporation."""
ALL = [*FLUIDS, *EXTREME]
each_fluid = pytest.mark.parametrize("fluid", ALL, ids=lambda f: type(f).__name__)


def seams(fluid: Fluid) -> list[float]:
    """Gauge pressures [Pa] at which the fluid's law changes from one piece to the next."""
    if not hasattr(fluid, "saturation_pressure"):
        return []
    saturated = fluid.saturation_pressure
    found = [saturated, saturated - fluid.dissolution_rounding * (saturated - P_ATM)]
    if hasattr(fluid, "vapour_range"):
        pressure = float(fluid._vapour()[0])
        found += [pressure * (1 - fluid.vapour_range), pressure, pressure * (1 + fluid.vapour_range)]
    return sorted(gauge_pressure(P, P_ATM, fluid.minimum_pressure)[0] for P in found)


def pressures(fluid: Fluid) -> np.ndarray:
    """Gauge pressures [Pa] from -1e7 to 1e9, dense at zero on both sides, at the seams and between those of vapour."""
    decades = np.logspace(-3, 7, 101)
    edges = seams(fluid)
    around = [edge + np.concatenate([[0], sign * np.logspace(-11, 3, 29)]) for edge in edges for sign in (1, -1)]
    neighbours = [np.nextafter(edge, away) for edge in edges for away in (-1e9, 1e9)]
    change = np.linspace(edges[0], edges[2], 1001) if len(edges) == 5 else []
    wide = np.concatenate([-decades, [0], decades, np.logspace(7, 9, 51), np.linspace(-1.1, -0.9, 201) * BAR])
    return np.unique(np.concatenate([wide, change, neighbours, *around]))


class Laws:
    """Density, bulk modulus, enthalpy, energy density, and exact derivatives of the last two, at given pressures."""

    def __init__(self, fluid: Fluid, at: np.ndarray) -> None:
        p = ca.SX.sym("p")
        w, e = fluid.enthalpy(Sym(p)).sx, fluid.energy_density(Sym(p)).sx
        laws = [fluid.density(Sym(p)).sx, fluid.bulk_modulus(Sym(p)).sx, w, e, ca.jacobian(w, p), ca.jacobian(e, p)]
        found = ca.Function("laws", [p], laws).map(len(at))(at.reshape(1, -1))
        self.rho, self.beta, self.w, self.e, self.dw, self.de = (np.array(v).ravel() for v in found)


@each_fluid
def test_slope_of_enthalpy(fluid):
    """dw/dp = 1/rho everywhere, to 1e-9: the share of liquid is known to 1e-16, vapour's density is 1e-5."""
    found = Laws(fluid, pressures(fluid))
    np.testing.assert_allclose(found.dw * found.rho, 1, rtol=0, atol=1e-9)


@each_fluid
def test_enthalpy_is_the_integral_of_volume(fluid):
    """w against adaptive quadrature from seam to seam, inside the vapour's seams and across them all; 0 at 0 bar."""
    assert fluid.enthalpy(0.0) == 0
    known, edges = 0.0, sorted(seams(fluid), reverse=True)
    below = [edge for edge in edges if edge < 0]
    for upper, lower in zip([0.0, *below], [*below, -1.1 * BAR], strict=True):
        known -= quad(lambda p: 1 / fluid.density(p), lower, upper, epsabs=0, epsrel=1e-11, limit=500)[0]
        assert fluid.enthalpy(lower) == pytest.approx(known, rel=1e-9, abs=0)
    known, above = 0.0, sorted({1.0, 1e2, 1e4, BAR, 30 * BAR, 1e9} | {edge for edge in edges if edge > 0})
    for lower, upper in zip([0.0, *above], above, strict=False):
        known += quad(lambda p: 1 / fluid.density(p), lower, upper, epsabs=0, epsrel=1e-11, limit=500)[0]
        assert fluid.enthalpy(upper) == pytest.approx(known, rel=1e-10, abs=0)


@each_fluid
def test_energy_density(fluid):
    """e >= 0 and de/dp = w rho/beta, within the rounding of rho w - p and of rho dw/dp - 1."""
    at = pressures(fluid)
    found = Laws(fluid, at)
    air = getattr(fluid, "air_fraction", 0.0)
    rounding = 1e-15 * np.abs(at) + air * 1e-15 * P_ATM
    assert np.all(found.e >= -rounding)
    expected = found.w * found.rho / found.beta
    assert np.all(np.abs(found.de - expected) <= 1e-9 * np.abs(expected) + np.abs(found.dw * found.rho - 1) + 1e-15)


@each_fluid
def test_floats_vectors_and_symbols_agree(fluid):
    """One pressure, a vector of pressures and a symbol give the same numbers."""
    at = pressures(fluid)[::50]
    found = Laws(fluid, at)
    vector = ca.SX.sym("p", len(at))
    both = [fluid.enthalpy(Sym(vector, at.shape)), fluid.energy_density(Sym(vector, at.shape))]
    w, e = ca.Function("vector", [vector], [law.sx for law in both])(at)
    assert both[0].shape == both[1].shape == at.shape
    for law, scalars, symbols in ((fluid.enthalpy, found.w, w), (fluid.energy_density, found.e, e)):
        np.testing.assert_allclose(law(at), scalars, rtol=1e-11, atol=1e-9)
        np.testing.assert_allclose([law(p) for p in at], scalars, rtol=1e-11, atol=1e-9)
        np.testing.assert_allclose(np.array(symbols).ravel(), scalars, rtol=1e-11, atol=1e-9)


@each_fluid
def test_finite_with_symbolic_parameters(fluid):
    """Derivatives with respect to pressure and parameters, from -1e9 to 1e9 Pa, at zero and at every seam."""
    names = numeric_fields(type(fluid), fluid)
    p, parameters = ca.SX.sym("p"), ca.SX.sym("f", len(names))
    made = symbolic_copy(fluid, names, {n: Sym(parameters[k]) for k, n in enumerate(names)})
    laws = ca.vertcat(made.enthalpy(Sym(p)).sx, made.energy_density(Sym(p)).sx)
    function = ca.Function("laws", [p, parameters], [laws, ca.jacobian(laws, ca.vertcat(p, parameters))])
    numbers = np.array([float(getattr(fluid, n)) for n in names])
    for gauge in (-1e9, -1e7, -P_ATM, *seams(fluid), 0.0, 5 * BAR, 1e9):
        values, derivatives = function(gauge, numbers)
        assert np.all(np.isfinite(np.array(derivatives))), gauge
        assert float(values[0]) == pytest.approx(fluid.enthalpy(gauge), rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("p", [s * 10.0**k for k in range(9) for s in (1, -1)])
def test_rounding_in_a_stiff_liquid(p):
    """beta (e^x - 1 - x), x = p/beta, in 40 digits, from 1 Pa, where it is 4e-10 of p, to 1000 bar."""
    with localcontext() as context:
        context.prec = 40
        x = Decimal(p) / Decimal("1.4e9")
        stored, through = Decimal("1.4e9") * (x.exp() - 1 - x), Decimal("1.4e9") / 860 * (1 - (-x).exp())
    oil = SimpleOil(**OIL)
    assert oil.enthalpy(p) == pytest.approx(float(through), rel=1e-15, abs=0)
    assert oil.energy_density(p) == pytest.approx(float(stored), rel=1e-14, abs=1e-15 * abs(p))


def test_isothermal_air():
    """W = rho_l w with air that stays free, n = 1: liquid beta (1 - e^{-p/beta}) and a P_atm ln(P/P_atm); rounding."""
    air = {"air_fraction": 0.1, "saturation_pressure": 1e20, "polytropic_index": 1.0, "minimum_pressure": 1e-3}
    oil = AeratedOil(**OIL, **air)
    for gauge in (-0.9, -0.1, 1.0, 100.0):
        p = gauge * BAR
        known = 1.4e9 * -math.expm1(-p / 1.4e9) + 0.1 / 0.9 * P_ATM * math.log1p(p / P_ATM)
        assert 860 * oil.enthalpy(p) == pytest.approx(known, rel=1e-11)


def test_vapour_alone():
    """Below the change, between two pressures: P_v/(rho_v) ln of their ratio."""
    oil = CavitatingOil(**OIL, vapour_pressure="10 mbar", minimum_pressure=1e-4)
    rise = oil.enthalpy(400 - P_ATM) - oil.enthalpy(100 - P_ATM)
    assert rise == pytest.approx(1e3 / 0.02 * math.log(4), rel=1e-9)


# -- a fluid of one's own ----------------------------------------------------------------------------------------------


class Own(Fluid):
    """A liquid of 5000 bar, or a perfect gas, with nothing said about enthalpy."""

    gas: bool = False

    def density(self, p):
        return 1.2 * (1 + p / P_ATM) if self.gas else 860.0 * np.e ** (p / 5e8)


@pytest.mark.parametrize("p", [s * 10.0**k for k in range(-3, 9) for s in (1, -1)])
def test_default_enthalpy_of_a_liquid(p):
    """beta (1 - e^{-p/beta})/rho_0 from a thousandth of a Pa to 1000 bar, on both sides."""
    assert Own().enthalpy(p) == pytest.approx(5e8 / 860 * -math.expm1(-p / 5e8), rel=1e-13, abs=0)


@pytest.mark.parametrize("gauge", [-0.9, -0.5, 0.0, 0.1, 1.0, 30.0, 1000.0])
def test_default_enthalpy_of_a_gas(gauge):
    """P_atm/rho_0 ln(P/P_atm)."""
    p = gauge * BAR
    assert Own(gas=True).enthalpy(p) == pytest.approx(P_ATM / 1.2 * math.log1p(p / P_ATM), rel=1e-9)


def test_default_enthalpy_on_symbols():
    """The derivative is 1/rho, on a vector of pressures."""
    p, at = ca.SX.sym("p", 4), np.array([-1.0, 0.0, 300.0, 1000.0]) * BAR
    w = Own().enthalpy(Sym(p, (4,))).sx
    slope = np.diag(np.array(ca.Function("slope", [p], [ca.jacobian(w, p)])(at)))
    np.testing.assert_allclose(slope * Own().density(at), 1, rtol=1e-12)


# -- the manual --------------------------------------------------------------------------------------------------------


def test_the_energies_of_the_manual():
    """What a litre stores in docs/fluids.md, to the digits printed, and what a port carries, to 0.1 %."""
    page = (Path(__file__).parents[1] / "docs" / "fluids.md").read_text(encoding="utf-8")
    section = page[page.index("## Energy") :].split("\n## ")[0]
    head, *rows = re.findall(r"^\| (.+) \|$", section, re.MULTILINE)
    at = [float(cell.removesuffix(" bar")) * BAR for cell in head.split(" | ")[1:]]
    oil, airy = SimpleOil(**OIL), AeratedOil(**OIL, air_fraction="0.5 %", saturation_pressure="1000 bar")
    fluids = [oil, airy, MineralOil(grade="ISO VG 46"), Water()]
    for fluid, row in zip(fluids, rows, strict=True):
        assert row.split(" | ")[1:] == [f"{fluid.energy_density(p) / 1e3:.4g}" for p in at]
    for p, less in ((BAR, 0.001), (300 * BAR, 0.015)):
        assert 1 - airy.rho_0 * airy.enthalpy(p) / p == pytest.approx(less, abs=5e-4)


# -- building blocks ---------------------------------------------------------------------------------------------------


def test_gauge_pressure_turns_absolute_pressure_round():
    """From far below absolute zero to 1000 bar, with its slope."""
    p = np.array([-1e7, -P_ATM - 50, -P_ATM, -P_ATM + 50, 0, 1e8])
    absolute, slope = absolute_pressure(p, P_ATM, 100.0)
    back, inverse = gauge_pressure(absolute, P_ATM, 100.0)
    np.testing.assert_allclose(back, p, rtol=1e-14, atol=1e-10)
    np.testing.assert_allclose(inverse * slope, 1, rtol=1e-13)


@pytest.mark.parametrize("exponent", [-1.0, -1 + 1e-12, -1 - 1e-5, -0.999, -2.7, 0.0, 0.5])
def test_integral_of_a_power(exponent):
    """(x^{a+1} - 1)/(a + 1), and log x where a = -1; both derivatives finite there, x^a and log(x)^2/2."""
    x, a = ca.SX.sym("x"), ca.SX.sym("a")
    law = ca.log(x) * grown(Sym((a + 1) * ca.log(x))).sx
    function = ca.Function("power", [x, a], [law, ca.jacobian(law, x), ca.jacobian(law, a)])
    for at in (1e-3, 0.7, 1.0, 1.001, 40.0):
        value, slope, other = (float(v) for v in function(at, exponent))
        known = quad(lambda u: math.exp((exponent + 1) * u), 0, math.log(at), epsabs=0, epsrel=1e-13)[0]
        assert value == pytest.approx(known, rel=1e-12)
        assert slope == pytest.approx(at**exponent, rel=1e-12)
        weighted = quad(lambda u: u * math.exp((exponent + 1) * u), 0, math.log(at), epsabs=0, epsrel=1e-13)[0]
        assert other == pytest.approx(weighted, rel=1e-8)


def test_gauss_legendre():
    """Exact for x^47; on symbols the derivative is the integrand."""
    assert gauss_legendre(lambda x: x**47, 0.0, 1.0) == pytest.approx(1 / 48, rel=1e-14)
    b = ca.SX.sym("b")
    whole = gauss_legendre(lambda x: x**3, 1.0, Sym(b)).sx
    value, slope = ca.Function("whole", [b], [whole, ca.jacobian(whole, b)])(3.0)
    assert float(value) == pytest.approx(20, rel=1e-14)
    assert float(slope) == pytest.approx(27, rel=1e-14)


def test_no_events_within_an_integral():
    """A table's knots are events where the circuit is, as the tracer asks, and none at the nodes of a quadrature."""

    class Refusing:
        def __init__(self):
            self.halvings = {}

        def bit(self, relation):
            raise AssertionError(relation)

    b, knots, values = ca.SX.sym("b"), (0.0, 1.0, 2.0), (0.0, 1.0, 4.0)
    token = TRACER.set(Refusing())
    try:
        with pytest.raises(AssertionError):
            table(Sym(b), knots, values)
        whole = gauss_legendre(lambda x: table(x, knots, values), 1.0, Sym(b)).sx
        with pytest.raises(AssertionError):
            table(Sym(b), knots, values)
    finally:
        TRACER.reset(token)
    assert float(ca.Function("whole", [b], [whole])(2.0)) == pytest.approx(2.5, rel=1e-14)
