"""Fittings of pipes: bends, elbows, changes of section, local losses by their coefficient.

Their pressures are total pressures, as those of the volumes and sources between which they stand.
"""

from typing import Any, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi, sin, table, where
from crescentlab.units import Angle, Flow, Length, Ratio

from .flow_laws import local_loss_flow, pipe_friction_flow

DEGREE = pi / 180


class LocalLoss(Component):
    r"""Local loss by its coefficient on the dynamic head: valves, tees, entries, exits.

    .. math:: p_a - p_b = \left(\zeta + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad
              v = \frac{4 \rho_0 q}{n \pi d^2 \rho}, \quad Re = \frac{|v| d}{\nu}

    p [Pa] gauge, total; d = `diameter` [m] to which \zeta = `loss_coefficient` [-] refers; from b to a
    `loss_coefficient_back` counts, by default the same; K_1 = `laminar_coefficient` [-]; n = `parallel` [-]; q [m^3/s]
    mass flow over \rho_0; \rho [kg/m^3], \nu [m^2/s] at the mean pressure. Some pairs K_1, \zeta by Hooper: pipe entry
    160, 0.5; ball or gate valve 300, 0.1; globe valve 1500, 4; lift check valve 2000, 10; tee, branch 800, 0.8; in
    small bores \zeta is larger, by the factor 1 + 25.4 mm/d, but not that of entries. Not for losses that stand so
    close that they disturb each other.
    Source: W. B. Hooper, Chem. Eng. 88 (1981) 17, 96-100; I. E. Idelchik, Handbook of Hydraulic Resistance.
    """

    diameter: Length = Field(gt=0, description="bore to which the coefficients refer")
    loss_coefficient: Ratio = Field(ge=0, description="at high Reynolds numbers, on the dynamic head")
    loss_coefficient_back: Ratio | None = Field(default=None, ge=0, description="from b to a; default: the same")
    laminar_coefficient: Ratio = Field(default=500.0, gt=0, description="coefficient times Reynolds number at small Re")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal losses side by side")

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        loss: Any = self.loss_coefficient
        if self.loss_coefficient_back is not None:
            loss = where(p_a > p_b, self.loss_coefficient, self.loss_coefficient_back)
        one = local_loss_flow(p_a, p_b, self.diameter, loss, self.laminar_coefficient, fluid)
        q = self.parallel * one
        return {"q_a": q, "q_b": -q, "q": q}


SHARP_TURN = 70 * DEGREE
"""Up to this angle a bend's loss goes with the sine of the angle."""

TURNS = (SHARP_TURN, 90 * DEGREE, 100 * DEGREE, pi)
TURN_FACTORS = (0.9 * float(sin(SHARP_TURN)), 1.0, 0.7 + 0.35 * 100 / 90, 1.4)
"""Loss of bends by these angles over that of a bend by 90 degrees; straight lines between."""


def bend_loss(curvature: Any, angle: Any) -> Any:
    r"""Loss coefficient [-] of a smooth round bend, besides its friction.

    .. math:: \zeta = A_1(\delta)\, B_1, \quad B_1 = 0.21\, (R/d)^{-5/2} \ (R < d), \quad
              B_1 = 0.21\, (R/d)^{-1/2} \ (R \ge d)

    R/d = `curvature` [-], radius of the axis over the bore; \delta = `angle` [rad]; A_1 = 0.9 \sin\delta up to 70
    degrees, 1 at 90, 0.7 + 0.35 \delta/90 from 100 degrees on, straight lines between. For Re from 300 000 on.
    Source: I. E. Idelchik, Handbook of Hydraulic Resistance, diagram 6-1.
    """
    turned = where(angle < SHARP_TURN, 0.9 * sin(angle), table(angle, TURNS, TURN_FACTORS, flag_knots=False))
    return turned * where(curvature < 1, 0.21 * curvature**-2.5, 0.21 * curvature**-0.5)


class Bend(Component):
    r"""Smooth bend of a round pipe: the friction along its axis and the loss by its curvature.

    .. math:: p_a - p_b = \left(f \frac{R \delta}{d} + A_1 B_1 + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad
              B_1 = 0.21\, (R/d)^{-5/2} \ (R < d), \quad B_1 = 0.21\, (R/d)^{-1/2} \ (R \ge d)

    p [Pa] gauge, total; d = `diameter`, R = `radius` of the axis [m]; \delta = `angle` [rad]; A_1 [-] is 0.9 sin \delta
    up to 70 degrees, 1 at 90, 0.7 + 0.35 \delta/90 from 100 degrees on; f [-] Darcy factor of Churchill with
    `roughness`; K_1 = `laminar_coefficient` [-]; v [m/s], \rho [kg/m^3], \nu [m^2/s] as in `pipe_resistance`; Re =
    |v| d/\nu [-]. K_1 is by default Hooper's for 90 degrees with R/d of 1 and 1.5; he has 500 for 45 degrees, 1000 for
    180. Idelchik has 600 for R/d above 2, 1000 from 1 to 2, 4000 to 2000 from 0.7 to 1, 6000 from 0.55 to 0.7, 4000
    below, at any angle. For R/d from 0.5 on and ten diameters of straight pipe ahead of the bend. Between Re = 6500 and
    300 000 the diagram has up to half as much again as A_1 B_1 + K_1/Re, most at 20 000. Not for square corners
    (`elbow`). Source: I. E. Idelchik, Handbook of Hydraulic Resistance, diagram 6-1; W. B. Hooper, Chem. Eng. 88 (1981)
    17, 96-100; S. W. Churchill (1977).
    """

    diameter: Length = Field(gt=0, description="inner diameter")
    radius: Length = Field(gt=0, description="radius of the pipe's axis")
    angle: Angle = Field(default=pi / 2, gt=0, le=pi, description="by which the flow is turned")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness; 0 is smooth")
    laminar_coefficient: Ratio = Field(default=800.0, ge=0, description="coefficient times Reynolds number at small Re")

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    @model_validator(mode="after")
    def _can_be_bent(self) -> Self:
        if self.radius < 0.5 * self.diameter:
            raise ValueError(
                f"radius ({self.radius * 1e3:g} mm) must be at least half the diameter "
                f"({self.diameter * 1e3:g} mm); a sharp corner is an elbow"
            )
        return self

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        length, loss = self.radius * self.angle, bend_loss(self.radius / self.diameter, self.angle)
        q = pipe_friction_flow(p_a, p_b, length, self.diameter, self.roughness, fluid, loss, self.laminar_coefficient)
        return {"q_a": q, "q_b": -q, "q": q}


class Elbow(Component):
    r"""Sharp corner of a round pipe or drilled channel.

    .. math:: p_a - p_b = \left(\zeta + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad
              \zeta = 0.9457 \sin^2\frac{\delta}{2} + 2.047 \sin^4\frac{\delta}{2}

    p [Pa] gauge, total; d = `diameter` [m]; \delta = `angle` [rad]; K_1 = `laminar_coefficient` [-], by default that of
    90 degrees; v [m/s] mean velocity in the bore, that of q as in `local_loss`; Re = |v| d/\nu [-]; \rho [kg/m^3], \nu
    [m^2/s] at the mean pressure.
    Later sources give from 0.8 to 1.2 at 90 degrees; Idelchik takes 1.2 times this formula there and 2.5 times at 20
    degrees. Not for corners closer to each other than some diameters. Source: J. Weisbach's formula of elbows, in I. E.
    Idelchik, Handbook of Hydraulic Resistance, chapter 6; K_1 of a mitred corner: W. B. Hooper, Chem. Eng. 88 (1981)
    17, 96-100.
    """

    diameter: Length = Field(gt=0, description="inner diameter")
    angle: Angle = Field(default=pi / 2, gt=0, le=pi, description="by which the flow is turned")
    laminar_coefficient: Ratio = Field(
        default=1000.0, gt=0, description="coefficient times Reynolds number at small Re"
    )

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        squared = sin(self.angle / 2) ** 2
        loss = 0.9457 * squared + 2.047 * squared * squared
        q = local_loss_flow(p_a, p_b, self.diameter, loss, self.laminar_coefficient, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class SuddenExpansion(Component):
    r"""Sudden expansion from a narrow section at a into a wide one at b; backwards a sudden contraction.

    .. math:: p_a - p_b = \left(\zeta + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad
              \zeta_{ab} = (1 - A_1/A_2)^2, \quad \zeta_{ba} = \tfrac12 (1 - A_1/A_2)^{3/4}

    p [Pa] gauge, total: what the expansion wins back from the dynamic head is not in the drop; v [m/s], Re [-] of q as
    in `local_loss`, in the narrow section A_1 of `narrow_diameter`; A_2 [m^2] of `wide_diameter`; K_1 =
    `laminar_coefficient` [-]; \rho [kg/m^3], \nu [m^2/s] at the mean pressure. From Re = 10 to 5000 the diagrams'
    tables have more: a contraction up to 1.7 times, an expansion up to 3 times, at Re = 1000. Not for tapered pipes.
    Source: Borda-Carnot, from the balance of momentum; contraction, and K_1 = 30 below Re = 10: I. E. Idelchik,
    Handbook of Hydraulic Resistance, diagrams 4-1, 4-9 and 4-10.
    """

    narrow_diameter: Length = Field(gt=0, description="of the narrow section")
    wide_diameter: Length = Field(gt=0, description="of the wide section; larger than the narrow one")
    laminar_coefficient: Ratio = Field(default=30.0, gt=0, description="coefficient times Reynolds number at small Re")

    a = takes_pressure("narrow end")
    b = takes_pressure("wide end")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    @model_validator(mode="after")
    def _widens(self) -> Self:
        if self.wide_diameter <= self.narrow_diameter:
            raise ValueError(
                f"wide_diameter ({self.wide_diameter * 1e3:g} mm) must be larger than "
                f"narrow_diameter ({self.narrow_diameter * 1e3:g} mm)"
            )
        return self

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self._flow(p_a, p_b, fluid)
        return {"q_a": q, "q_b": -q, "q": q}

    def _flow(self, p_narrow: Expr, p_wide: Expr, fluid: Fluid) -> Any:
        """Flow [m^3/s] from the narrow into the wide section."""
        ratio = (self.narrow_diameter / self.wide_diameter) ** 2
        loss = where(p_narrow > p_wide, (1 - ratio) ** 2, 0.5 * (1 - ratio) ** 0.75)
        return local_loss_flow(p_narrow, p_wide, self.narrow_diameter, loss, self.laminar_coefficient, fluid)


class SuddenContraction(SuddenExpansion):
    r"""Sudden contraction from a wide section at a into a narrow one at b; backwards a sudden expansion.

    .. math:: p_a - p_b = \left(\zeta + \frac{K_1}{Re}\right) \frac{\rho v |v|}{2}, \quad
              \zeta_{ab} = \tfrac12 (1 - A_1/A_2)^{3/4}, \quad \zeta_{ba} = (1 - A_1/A_2)^2

    p [Pa] gauge, total; v [m/s], Re [-] in the narrow section A_1 of `narrow_diameter`; A_2 [m^2] of `wide_diameter`;
    all else as in `sudden_expansion`. Not for rounded or tapered entries. Source: I. E. Idelchik, Handbook of Hydraulic
    Resistance, diagrams 4-9 and 4-10; backwards Borda-Carnot.
    """

    a = takes_pressure("wide end")
    b = takes_pressure("narrow end")

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = -self._flow(p_b, p_a, fluid)
        return {"q_a": q, "q_b": -q, "q": q}
