"""The contract finds what it is for: a good class passes, and each kind of slip is told with class and name."""

from __future__ import annotations

import pytest
from crescentlab.components.check_valves import CheckValve
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.pipes import Pipe
from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.contract import check_component, check_fluid
from crescentlab.domain import (
    dissipates,
    gives_pressure,
    observable,
    state,
    stores,
    stores_energy,
    takes_motion,
    takes_pressure,
)
from crescentlab.errors import ComponentError
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fabs, hypot, sqrt
from crescentlab.units import Area, Flow, Pressure, Stiffness, Volume

OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)


class Hole(Component):
    r"""Hole.

    .. math:: q = A \sqrt{2 \Delta p/\rho}

    p [Pa]; q [m^3/s]; A = `area` [m^2]; \rho [kg/m^3]. Not for laminar flow. Source: Bernoulli's law.
    """

    area: Area = Field(gt=0, description="flow area")
    rounding: Pressure = Field(default=100.0, gt=0, description="rounding of the velocity at zero drop")

    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    q = observable(Flow, "flow from a to b")

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.area * sqrt(2 / fluid.density(0.0)) * (p_a - p_b) / sqrt(hypot(p_a - p_b, self.rounding))
        return {"q_a": q, "q_b": -q, "q": q}


class Volumes(Component):
    r"""Volume of fluid.

    .. math:: \dot p = \beta q/V

    p [Pa]; q [m^3/s]; V = `volume` [m^3]; \beta [Pa]. Not for walls that stretch. Source: definition of \beta.
    """

    volume: Volume = Field(gt=0, description="fluid volume")

    port = gives_pressure("the volume")
    p = state(Pressure, "pressure", start=0.0, nominal=1e5)
    content = stores()

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        r = fluid.density(p) / fluid.rho_0
        return {"p_port": p, "der_p": fluid.bulk_modulus(p) / self.volume / r * q_port, "content": self.volume * r}


@pytest.mark.parametrize("good", [Hole, Hole(area=1e-6), Volumes, Pipe], ids=["class", "instance", "stores", "family"])
def test_what_is_right_passes(good: Component | type[Component]) -> None:
    check_component(good, OIL)


class NoSource(Hole):
    r"""Hole.

    .. math:: q = A \sqrt{2 \Delta p/\rho}

    p [Pa]; q [m^3/s].
    """


class NotRaw(Hole):
    """Hole.

    .. math:: q = A v

    v [m/s], the density \rho [kg/m^3]. Source: Bernoulli's law.
    """


class NoMeaning(Hole):
    __doc__ = Hole.__doc__
    area: Area = Field(gt=0)


class InfiniteSlope(Hole):
    __doc__ = Hole.__doc__

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.area * (p_a - p_b) / sqrt(fabs(p_a - p_b)) / fluid.density(0.0)
        return {"q_a": q, "q_b": -q, "q": q}


class TwoTexts(Hole):
    __doc__ = Hole.__doc__

    def equations(self, p_a: Expr, p_b: Expr) -> Equations:
        q = self.area * (p_a - p_b) * (1e-3 if isinstance(p_a, float) else 2e-3)
        return {"q_a": q, "q_b": -q, "q": q}


class Keeps(Hole):
    __doc__ = Hole.__doc__

    def equations(self, p_a: Expr, p_b: Expr) -> Equations:
        q = self.area * (p_a - p_b)
        return {"q_a": q, "q_b": -0.999 * q, "q": q}


class Lopsided(Hole):
    __doc__ = Hole.__doc__

    def equations(self, p_a: Expr, p_b: Expr) -> Equations:
        q = self.area * (p_a - p_b) * (1 + 1e-6 * p_a)
        return {"q_a": q, "q_b": -q, "q": q}


class Forgets(Volumes):
    __doc__ = Volumes.__doc__

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        return {"p_port": p, "der_p": fluid.bulk_modulus(p) / self.volume * q_port, "content": self.volume}


class MovesMore(Hole):
    __doc__ = Hole.__doc__
    stored_energy = stores_energy()
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.area * (p_a - p_b)
        return {"q_a": q, "q_b": -q, "q": q, "stored_energy": 0.0, "loss": 0.5 * q * (p_a - p_b)}


class Pushes(Hole):
    __doc__ = Hole.__doc__
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = -self.area * (p_a - p_b)
        return {"q_a": q, "q_b": -q, "q": q}


class Limp(Component):
    r"""Spring that pushes one end more than the other.

    .. math:: f = k x

    f [N]; k = `stiffness` [N/m]; x [m]. Not for use. Source: Hooke's law.
    """

    stiffness: Stiffness = Field(gt=0, description="force per length")

    a = takes_motion("one end")
    b = takes_motion("other end")

    def equations(self, x_a: Expr, x_b: Expr) -> Equations:
        force = self.stiffness * (x_a - x_b)
        return {"f_a": force, "f_b": -0.9 * force}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (NoSource, "NoSource: its docstring has no source: 'Source:' is missing"),
        (NotRaw, r"NotRaw: its docstring holds '\\r'; begin it with r, so that a backslash stays one"),
        (NoMeaning, "NoMeaning: area has no description"),
        (InfiniteSlope, "InfiniteSlope: d q_a / d p_a is (inf|nan) at p_a = 0.0, p_b = 0.0"),
        (TwoTexts, "TwoTexts: q is .* on symbols and .* on floats; use crescentlab.maths"),
        (Keeps, r"Keeps: q_a is .* m\^3/s, q_b .*; their sum must be 0"),
        (Lopsided, "Lopsided: .*with the pressures exchanged .*; it must be the opposite"),
        (Forgets, r"Forgets: content grows by 0 m\^3/s, but .* m\^3/s flow in"),
        (MovesMore, "MovesMore: .* W enter and 0 W are supplied, but 0 W are stored and .* W lost"),
        (Pushes, "Pushes: -.* W enter and 0 W are supplied, and -.* W lost: heat does no work"),
        (Limp, r"Limp: f_a is .*, f_b .*; their sum must be 0"),
    ],
    ids=lambda given: given.__name__ if isinstance(given, type) else "",
)
def test_a_slip_is_told(wrong: type[Component], told: str) -> None:
    with pytest.raises(AssertionError, match=f"^{told}"):
        check_component(wrong, OIL)


def test_what_passes_backwards_is_said() -> None:
    """A check valve passes nothing backwards; a hole passes as much, which neither of the other two words allows."""
    check_component(CheckValve, OIL, backwards="nothing")
    check_component(Lopsided, OIL, backwards="unequal")
    with pytest.raises(AssertionError, match="if that is meant, check with backwards='unequal' or 'nothing'"):
        check_component(CheckValve, OIL)
    with pytest.raises(AssertionError, match="nothing may pass backwards"):
        check_component(Hole, OIL, backwards="nothing")
    with pytest.raises(AssertionError, match=r"the signs must differ, and the sizes by more than 0\.1 %"):
        check_component(Hole, OIL, backwards="unequal")
    with pytest.raises(TypeError, match="backwards='none': write one of 'equal', 'unequal', 'nothing'"):
        check_component(Hole, OIL, backwards="none")  # type: ignore[arg-type]


class RootVolume(Volumes):
    __doc__ = Volumes.__doc__

    def equations(self, p: Expr, q_port: Expr) -> Equations:
        return {"p_port": p, "der_p": sqrt(p) / self.volume * q_port, "content": 2 * self.volume * sqrt(p)}


def test_values_the_equations_do_not_admit_are_left_out() -> None:
    """sqrt(p) has no value below 0, and no slope at 0; above, 2 V sqrt(p) grows by q."""
    with pytest.raises(AssertionError, match=r"RootVolume: der_p is \[nan\] on floats; narrow it by within="):
        check_component(RootVolume)
    check_component(RootVolume, within={"p": (1e4, 1e6)})
    with pytest.raises(TypeError, match="RootVolume: within names x; its equations know p, q_port"):
        check_component(RootVolume, within={"x": (0.0, 1.0)})


class Steam(Fluid):
    """Fluid of a constant density that claims to be compressible."""

    def density(self, p: Expr) -> Expr:
        return 860.0 + 0.0 * p

    def bulk_modulus(self, p: Expr) -> Expr:
        return 1.4e9 + 0.0 * p

    def kinematic_viscosity(self, p: Expr) -> Expr:
        return 35e-6 + 0.0 * p


class Warm(SimpleOil):
    """Oil whose energy is that of another."""

    def enthalpy(self, p: Expr) -> Expr:
        return 1.01 * super().enthalpy(p)


def test_the_laws_of_a_fluid_belong_together() -> None:
    """A bulk modulus without its density, an enthalpy without its density, and a density without its enthalpy."""
    check_fluid(OIL)
    with pytest.raises(AssertionError, match=r"Steam at -0\.9 bar: bulk_modulus is 1\.4e\+09 Pa, .* inf Pa"):
        check_fluid(Steam())
    with pytest.raises(AssertionError, match=r"Warm at .*: the slope of enthalpy is"):
        check_fluid(Warm(**OIL.model_dump(by_alias=True)))
    with pytest.raises(ComponentError, match="Dense: has a density of its own and the enthalpy of SimpleOil"):

        class Dense(SimpleOil):
            """Oil with a density of its own."""

            def density(self, p: Expr) -> Expr:
                return 900.0 + 0.0 * p


def test_a_fluid_is_asked_for() -> None:
    with pytest.raises(TypeError, match=r"Hole asks for a fluid; write check_component\(Hole, SimpleOil"):
        check_component(Hole)
