"""Metering edges of spools: annular ports, slots, notches, with steady and transient flow forces.

Round holes, the ends of a spool and its leaking lands are in `valve_parts`. Join the parts on the rod of a mass.
"""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_motion, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi, sin, tan
from crescentlab.units import Angle, Area, Flow, Force, Length

from .valve_laws import SpoolEdge, Uncovered, limited, opening


class AnnularPort(SpoolEdge, Component):
    r"""Annular port that the edge of a spool uncovers over its whole circumference.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad A = \pi d h, \quad
              F_{jet} = k \rho_0 |q| v_{jet} \cos\vartheta, \quad F_t = L \rho_0 \frac{q}{A} \frac{dA}{dx} v

    \Delta p = p_a - p_b [Pa]; d = `diameter` [m]; h = \pm x - `overlap` [m], x [m], + for `opens` up; C_d [-] follows
    the flow number as in `orifice`, with the hydraulic diameter 2 h; v_jet = \sqrt{2|\Delta p|/\rho} [m/s]; \rho
    [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge; k = `jet_coefficient` [-]. F_jet [N] closes
    whichever way the fluid flows. \vartheta = `jet_angle` [rad]: 69 deg for an opening much wider than the clearance,
    falling to 21 deg for one much smaller (von Mises). F_t [N] acts against v [m/s] of the rod where the fluid flows
    from a to b, L = `damping_length` [m] of the fluid that the edge speeds up on side a (the spool's chamber is there:
    the edge meters out); with the chamber on side b L is negative and F_t is with the motion. The part of F_t with
    dp/dt is left out. Not for leakage at overlap (`leakage_land` beside it), nor for cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, flow forces on spool valves.
    """

    diameter: Length = Field(gt=0, description="diameter of the spool")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    rod = takes_motion("the spool")
    q = observable(Flow, "flow from a to b")
    area = observable(Area, "open area")
    jet_force = observable(Force, "steady flow force, positive towards closing")
    transient_force = observable(Force, "transient flow force, positive towards decreasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        h, slope = opening(self.travel(x_rod), self.edge_rounding)
        width = pi * self.diameter
        return self.issued(Uncovered(width * h, width * slope, 2 * h), p_a, p_b, v_rod, fluid)


class RectangularSlots(SpoolEdge, Component):
    r"""Rectangular slots that the edge of a spool uncovers.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad A = n b h, \quad
              d_h = \frac{2 b h}{b + h}

    \Delta p = p_a - p_b [Pa]; n = `number`; b = `width` [m] along the circumference; h = \pm x - `overlap` [m], at most
    `length`, x [m], + for `opens` up; \rho [kg/m^3]; discharge coefficient, flow forces [N] and all else as in
    `annular_port`, with the hydraulic diameter d_h [m] of one slot. Not for leakage at overlap, nor for cavitating
    flow. Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, flow forces on spool valves.
    """

    number: int = Field(default=1, ge=1, description="number of slots")
    width: Length = Field(gt=0, description="width of a slot along the circumference")
    length: Length = Field(gt=0, description="length of a slot along the axis")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    rod = takes_motion("the spool")
    q = observable(Flow, "flow from a to b")
    area = observable(Area, "open area of all slots")
    jet_force = observable(Force, "steady flow force, positive towards closing")
    transient_force = observable(Force, "transient flow force, positive towards decreasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        h, slope = limited(*opening(self.travel(x_rod), self.edge_rounding), self.length)
        all_wide = self.number * self.width
        d_h = 2 * self.width * h / (self.width + h)
        return self.issued(Uncovered(all_wide * h, all_wide * slope, d_h), p_a, p_b, v_rod, fluid)


class TriangularNotches(SpoolEdge, Component):
    r"""Triangular notches in the edge of a spool, which open softly.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              A = n h^2 \tan\frac{\varphi}{2}, \quad d_h = \frac{2 h \sin(\varphi/2)}{1 + \sin(\varphi/2)}

    \Delta p = p_a - p_b [Pa]; n = `number`; \varphi = `angle` [rad] of the tip; h = \pm x - `overlap` [m], at most
    `length`, x [m], + for `opens` up; \rho [kg/m^3]; discharge coefficient, flow forces [N] and all else as in
    `annular_port`, with the hydraulic diameter d_h [m] of one notch. The area is that seen along the radius: not for
    notches shallower than they are wide, nor for cavitating flow.
    Source: geometry of a triangle; H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, flow forces.
    """

    number: int = Field(default=1, ge=1, description="number of notches")
    angle: Angle = Field(default=pi / 3, gt=0, lt=pi, description="angle of the tip")
    length: Length = Field(gt=0, description="length of a notch along the axis")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    rod = takes_motion("the spool")
    q = observable(Flow, "flow from a to b")
    area = observable(Area, "open area of all notches")
    jet_force = observable(Force, "steady flow force, positive towards closing")
    transient_force = observable(Force, "transient flow force, positive towards decreasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        h, slope = limited(*opening(self.travel(x_rod), self.edge_rounding), self.length)
        wide, s = self.number * tan(self.angle / 2), sin(self.angle / 2)
        uncovered = Uncovered(wide * h * h, 2 * wide * h * slope, 2 * h * s / (1 + s))
        return self.issued(uncovered, p_a, p_b, v_rod, fluid)
