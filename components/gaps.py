"""Narrow gaps with laminar flow: flat slots, annuli, face gaps; fixed, signalled, or with a wall that moves."""

from typing import Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_motion, takes_pressure, takes_rotation, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, log, pi, sqrt
from crescentlab.units import Angle, Flow, Force, Length, Ratio, Torque

from .flow_laws import annular_flow, drag_flow, radial_flow, slot_flow


class LaminarGap(Component):
    r"""Flat gap of fixed height with laminar flow.

    .. math:: q = \frac{\rho}{\rho_0} n \frac{b h^3}{12 \mu l} (p_a - p_b)

    b = `width` across the flow, h = `height`, l = `length` along the flow [m]; n = `parallel` [-] gaps side by side; p
    [Pa] gauge; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. With `count` a vector of equal
    gaps, each between its own pair of ports. Not for turbulent flow, nor for walls that move along the flow.
    Source: plane Poiseuille flow; Rundo & Corvaglia (2016), Eqs. 20, 22 and 26.
    """

    width: Length = Field(gt=0, description="across the flow")
    height: Length = Field(ge=0, description="clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    q = observable(Flow, "flow from a to b", size="count")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.parallel * slot_flow(p_a, p_b, self.width, self.height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class VariableHeightGap(Component):
    r"""Flat gap whose height a signal changes, for example by the deflection of a cover.

    .. math:: q = \frac{\rho}{\rho_0} n \frac{b (h + k\,\Delta h)^3}{12 \mu l} (p_a - p_b)

    b = `width`, h = `height` at rest, l = `length` [m]; \Delta h = `change` [m], k = `change_factor` [-]; a height
    below 0 counts as 0; n = `parallel` [-] gaps side by side; p [Pa] gauge; \mu [Pa s], \rho [kg/m^3] at the mean
    pressure, \rho_0 at 0 bar gauge. With `count` a vector of gaps that share one change. Not for turbulent flow.
    Source: Rundo & Corvaglia (2016), Eq. 17 (k = 1) and Eq. 18 (k = 0.75).
    """

    width: Length = Field(gt=0, description="across the flow")
    height: Length = Field(ge=0, description="clearance at zero change")
    length: Length = Field(gt=0, description="along the flow")
    change_factor: Ratio = Field(default=1.0, description="height gained per change signalled")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    change = takes_signal(Length, "change of the height, for all gaps")
    q = observable(Flow, "flow from a to b", size="count")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, change: Expr, fluid: Fluid) -> Equations:
        height = self.height + self.change_factor * change
        q = self.parallel * slot_flow(p_a, p_b, self.width, height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class VariableWidthGap(Component):
    r"""Flat gap of which a signal opens a share of the width, for example while a volume exists.

    .. math:: q = \frac{\rho}{\rho_0} n \frac{s b h^3}{12 \mu l} (p_a - p_b)

    s = `opening` [-], open share of b = `width` [m]; h = `height`, l = `length` [m]; n = `parallel` [-] gaps side by
    side; p [Pa] gauge; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. With `count` a vector of
    gaps, each with its own opening. Not for turbulent flow. Source: Rundo & Corvaglia (2016), Eq. 22.
    """

    width: Length = Field(gt=0, description="across the flow, when fully open")
    height: Length = Field(ge=0, description="clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    opening = takes_signal(Ratio, "open share of the width", size="count", low=0, high=1)
    q = observable(Flow, "flow from a to b", size="count")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, opening: Expr, fluid: Fluid) -> Equations:
        q = self.parallel * slot_flow(p_a, p_b, self.width * opening, self.height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class AnnularGap(Component):
    r"""Narrow annulus round an eccentric shaft or spool, laminar.

    .. math:: q = \frac{\rho}{\rho_0} n \frac{\pi d c^3 (1 + 1.5 \varepsilon^2)}{12 \mu l} (p_a - p_b)

    d = `diameter` [m]; c = `clearance` [m], radial: half the difference of the two diameters; \varepsilon =
    `eccentricity` [-], offset of the axes over c; l = `length` [m]; n = `parallel` [-] gaps side by side; p [Pa] gauge;
    \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. With d = 2 R it is the paper's \pi R h^3 (1 +
    1.5\varepsilon^2)/(6 \mu l). With `count` a vector of equal gaps. Not for tilted shafts, c close to d, turbulent
    flow or drag. Source: Rundo & Corvaglia (2016), Eq. 23.
    """

    diameter: Length = Field(gt=0, description="of the shaft")
    clearance: Length = Field(ge=0, description="radial clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    eccentricity: Ratio = Field(default=0.0, ge=0, le=1, description="offset of the axes over the clearance")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    q = observable(Flow, "flow from a to b", size="count")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        one = annular_flow(p_a, p_b, self.diameter, self.clearance, self.eccentricity, self.length, fluid)
        q = self.parallel * one
        return {"q_a": q, "q_b": -q, "q": q}


class AxialFaceGap(Component):
    r"""Gap between parallel faces, through which fluid leaks radially: port plates, side plates, slippers.

    .. math:: q = \frac{\rho}{\rho_0} n \frac{\alpha h^3}{12 \mu \ln(d_2/d_1)} (p_a - p_b)

    d_1 = `inner_diameter` at a, d_2 = `outer_diameter` at b, h = `height` [m]; \alpha = `angle` [rad] of the sector,
    for a whole disc by volume \pi h^3 \Delta p/(6 \mu \ln(r_2/r_1)); n = `parallel` [-] gaps side by side; p [Pa]
    gauge; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge. The pressure between the edges falls
    with the logarithm of the radius; `lift` [N] is its force on one face, gauge, over the gap alone: F = (\alpha/2)
    [r_2^2 p_b - r_1^2 p_a + (r_2^2 - r_1^2)(p_a - p_b)/(2 \ln(r_2/r_1))]. Not for tilted faces, turbulent gaps, or the
    inertia of fast radial flow. Source: Poiseuille flow between parallel discs; H. E. Merritt, Hydraulic Control
    Systems (1967), chapter 3.
    """

    inner_diameter: Length = Field(gt=0, description="of the gap, at a")
    outer_diameter: Length = Field(gt=0, description="of the gap, at b; larger than the inner")
    height: Length = Field(ge=0, description="clearance; 0 is closed")
    angle: Angle = Field(default=2 * pi, gt=0, le=2 * pi, description="sector that is open; default: all round")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")

    a = takes_pressure("inner edge")
    b = takes_pressure("outer edge")
    q = observable(Flow, "flow from a to b")
    lift = observable(Force, "pressure force of one gap that pushes its faces apart")
    loss = dissipates()

    @model_validator(mode="after")
    def _has_a_width(self) -> Self:
        if self.outer_diameter <= self.inner_diameter:
            raise ValueError(
                f"outer_diameter ({self.outer_diameter * 1e3:g} mm) must be larger than "
                f"inner_diameter ({self.inner_diameter * 1e3:g} mm)"
            )
        return self

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        d_1, d_2 = self.inner_diameter, self.outer_diameter
        q = self.parallel * radial_flow(p_a, p_b, d_1, d_2, self.height, self.angle, fluid)
        falling = (d_2 * d_2 - d_1 * d_1) * (p_a - p_b) / (2 * log(d_2 / d_1))
        lift = self.angle / 8 * (d_2 * d_2 * p_b - d_1 * d_1 * p_a + falling)
        return {"q_a": q, "q_b": -q, "q": q, "lift": lift}


class MovingAnnularGap(Component):
    r"""Annular gap round a piston or rod that slides: leakage, what the wall drags along, and the drag on it.

    .. math:: q = \frac{\rho}{\rho_0} \left(\frac{\pi d c^3 (1 + 1.5\varepsilon^2)}{12 \mu l} \Delta p
              + \frac{\pi d c}{2} v\right), \quad
              F = \frac{\pi d \mu l}{c \sqrt{1 - \varepsilon^2}} v - \frac{\pi d c}{2} \Delta p

    \Delta p = p_a - p_b [Pa]; q [m^3/s] from a to b, which lies towards increasing x; v [m/s] of the rod; F [N] drag on
    the rod towards decreasing x; d = `diameter`, c = `clearance` (radial), l = `length` [m], constant; \varepsilon =
    `eccentricity` [-], below 1, where the drag is infinite; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0
    bar gauge. What is lost, \rho_0 q (w(p_a) - w(p_b)) + F v = `loss` [W], is never negative. Not for the pressures on
    the ends of the piston (`spool_end`), a land whose overlap changes (`leakage_land`), tilt or turbulence.
    Source: plane Couette-Poiseuille flow integrated round the gap h = c (1 + \varepsilon cos \theta); J. Ivantysyn, M.
    Ivantysynova, Hydrostatic Pumps and Motors (2001), on piston and cylinder.
    """

    diameter: Length = Field(gt=0, description="of the piston")
    clearance: Length = Field(gt=0, description="radial clearance")
    length: Length = Field(gt=0, description="along the flow")
    eccentricity: Ratio = Field(default=0.0, ge=0, lt=1, description="offset of the axes over the clearance")

    a = takes_pressure("end towards decreasing x")
    b = takes_pressure("end towards increasing x")
    rod = takes_motion("the piston")
    q = observable(Flow, "flow from a to b")
    drag = observable(Force, "force on the piston, positive towards decreasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        drop, around = p_a - p_b, pi * self.diameter
        q = annular_flow(p_a, p_b, self.diameter, self.clearance, self.eccentricity, self.length, fluid)
        q = q + drag_flow(p_a, p_b, v_rod, around, self.clearance, fluid)
        narrow = self.clearance * sqrt(1 - self.eccentricity * self.eccentricity)
        shear = fluid.dynamic_viscosity((p_a + p_b) / 2) * self.length * v_rod / narrow
        drag = around * (shear - self.clearance / 2 * drop)
        loss = fluid.rho_0 * q * (fluid.enthalpy(p_a) - fluid.enthalpy(p_b)) + drag * v_rod
        return {"q_a": q, "q_b": -q, "f_rod": drag, "q": q, "drag": drag, "loss": loss}


class RotatingAnnularGap(Component):
    r"""Annular gap round a shaft that turns: leakage along the shaft and the viscous torque on it.

    .. math:: q = \frac{\rho}{\rho_0} \frac{\pi d c^3 (1 + 1.5\varepsilon^2)}{12 \mu l} (p_a - p_b), \quad
              T = \frac{\pi \mu d^3 l}{4 c \sqrt{1 - \varepsilon^2}}\, \omega

    d = `diameter`, c = `clearance` (radial), l = `length` [m]; \varepsilon = `eccentricity` [-], below 1; \omega
    [rad/s] of the shaft; T [N m] brakes the shaft; p [Pa] gauge; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0
    at 0 bar gauge; `loss` [W] of leakage and torque. Not for the pressure that a loaded bearing builds up itself, nor
    for Taylor vortices.
    Source: Petroff's law (1883), integrated round the gap h = c (1 + \varepsilon cos \theta); leakage: Rundo &
    Corvaglia (2016), Eq. 23.
    """

    diameter: Length = Field(gt=0, description="of the shaft")
    clearance: Length = Field(gt=0, description="radial clearance")
    length: Length = Field(gt=0, description="along the shaft")
    eccentricity: Ratio = Field(default=0.0, ge=0, lt=1, description="offset of the axes over the clearance")

    a = takes_pressure("one end")
    b = takes_pressure("other end")
    shaft = takes_rotation("the shaft")
    q = observable(Flow, "flow from a to b")
    torque = observable(Torque, "torque that brakes the shaft, positive against positive speed")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, omega_shaft: Expr, fluid: Fluid) -> Equations:
        q = annular_flow(p_a, p_b, self.diameter, self.clearance, self.eccentricity, self.length, fluid)
        narrow = self.clearance * sqrt(1 - self.eccentricity * self.eccentricity)
        mu = fluid.dynamic_viscosity((p_a + p_b) / 2)
        torque = pi * mu * self.diameter**3 * self.length / (4 * narrow) * omega_shaft
        loss = fluid.rho_0 * q * (fluid.enthalpy(p_a) - fluid.enthalpy(p_b)) + torque * omega_shaft
        return {"q_a": q, "q_b": -q, "torque_shaft": torque, "q": q, "torque": torque, "loss": loss}
