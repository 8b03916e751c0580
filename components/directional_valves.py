"""Directional valves: 2/2, 3/2, 4/2 and 4/3, driven by a stroke; and the second-order motion of a spool that gives it.

The stroke is a signal, so that any drive can be put before any valve: a constant, a ramp, a `spool_drive`.
"""

from typing import Any

from pydantic import BaseModel, Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, gives_signal, held, observable, state, takes_pressure, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi
from crescentlab.units import Area, Flow, Frequency, Ratio

from .valve_laws import Metering, edge_share, follower, middle_share


class Lapped(BaseModel):
    """How the edges of a valve lap."""

    overlap: Ratio = Field(
        default=0.0, gt=-1, lt=1, description="stroke at which an edge starts to open; below 0: open centre"
    )
    edge_rounding: Ratio = Field(default=1e-3, gt=0, lt=1, description="stroke within which an edge opens softly")

    def opened(self, stroke: Any) -> Any:
        """Open share [-] of an edge that opens towards a growing `stroke` [-]."""
        return edge_share(stroke, self.overlap, self.edge_rounding)


class SpoolDrive(Component):
    r"""Second-order motion of a valve's spool behind its command, between the ends of its stroke.

    .. math:: \frac{d^2 x}{dt^2} + 2 \zeta \omega \frac{dx}{dt} + \omega^2 x = \omega^2 u, \quad \omega = 2 \pi f, \quad
              -1 \le x \le 1

    x = `stroke` [-]; u = `command` [-], counted within -1 and 1; f = `natural_frequency` [Hz]; \zeta = `damping_ratio`
    [-]. At an end of its stroke the spool stops and rests until the command leads back. Not for a limited speed or
    power of the drive, nor for flow forces. Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 7,
    servovalve as a second-order element.
    """

    natural_frequency: Frequency = Field(gt=0, description="undamped natural frequency of the spool")
    damping_ratio: Ratio = Field(default=0.7, ge=0, description="damping over critical damping")

    command = takes_signal(Ratio, "stroke asked for", low=-1, high=1)
    stroke = gives_signal(Ratio, "stroke of the spool, -1 to 1")
    position = state(Ratio, "stroke of the spool", start=0.0, nominal=1.0)
    rate = state(Frequency, "strokes per time", start=0.0, nominal=100.0)
    at = held(Ratio, "-1 rests at the low end, 1 at the high one, 0 free", start=0.0)

    def equations(self, position: Expr, rate: Expr, at: Expr, command: Expr) -> Equations:
        omega = 2 * pi * self.natural_frequency
        moves = follower(position, rate, at, command, omega, self.damping_ratio, low=-1.0)
        return {"stroke": position, **moves}


class TwoTwoValve(Metering, Component):
    r"""2/2 directional valve, proportional or switching.

    .. math:: q = C_d s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad s = \frac{x - u}{1 - u}, \quad
              C_d = C_{d,max} \tanh(2\lambda/\lambda_c)

    \Delta p = p_a - p_b [Pa]; x = `stroke` [-], counted within 0 and 1; u = `overlap` [-]; s [-] is 0 below u, and the
    corner there is rounded within w = `edge_rounding` [-] on either side: at x = u it is open by w/4, at x = u - w
    shut; by default u = w, so that stroke 0 passes nothing; A = `area` [m^2]; \lambda = (d_h/\nu)
    \sqrt{2|\Delta p|/\rho} [-], d_h [m] of a round hole; \rho [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0
    bar gauge. Not for leakage when closed, nor for cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5; Rundo & Corvaglia (2016), Eqs. 27-29.
    """

    overlap: Ratio | None = Field(
        default=None, gt=-1, lt=1, description="stroke at which it starts to open; default: edge_rounding"
    )
    edge_rounding: Ratio = Field(default=1e-3, gt=0, lt=1, description="stroke within which it opens softly")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    stroke = takes_signal(Ratio, "0 is closed, 1 is open", low=0, high=1)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, stroke: Expr, fluid: Fluid) -> Equations:
        overlap = self.edge_rounding if self.overlap is None else self.overlap
        q = self.metered(p_a, p_b, edge_share(stroke, overlap, self.edge_rounding), fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class ThreeTwoValve(Metering, Lapped, Component):
    r"""3/2 directional valve: joins its work port to the tank at stroke 0, to the supply at stroke 1.

    .. math:: q_{sw} = C_d\, s(y) A \sqrt{2\rho|p_s - p_w|}/\rho_0\, \mathrm{sign}(p_s - p_w), \quad
              q_{wt} = C_d\, s(-y) A \sqrt{2\rho|p_w - p_t|}/\rho_0\, \mathrm{sign}(p_w - p_t), \quad y = 2 x - 1

    p [Pa] of supply, work port, tank; x = `stroke` [-], counted within 0 and 1; s(y) [-], A = `area` [m^2], C_d [-],
    \rho [kg/m^3] as in `two_two_valve`, u = `overlap` [-] being 0 by default. At either end of the stroke the edge that
    is not meant passes nothing, for any u > w - 1. On the way both edges are closed within the overlap, or both open
    where it is negative; at x = 1/2 both are shut for overlaps from `edge_rounding` on, open by a quarter of that at
    u = 0. Not for leakage, nor for cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, three-way spool valve.
    """

    supply = takes_pressure("supply port P")
    work = takes_pressure("work port A")
    tank = takes_pressure("tank port T")
    stroke = takes_signal(Ratio, "0 joins work port and tank, 1 supply and work port", low=0, high=1)
    q_in = observable(Flow, "flow from supply to work port")
    q_out = observable(Flow, "flow from work port to tank")
    loss = dissipates()

    def equations(self, p_supply: Expr, p_work: Expr, p_tank: Expr, stroke: Expr, fluid: Fluid) -> Equations:
        y = 2 * stroke - 1
        into = self.metered(p_supply, p_work, self.opened(y), fluid)
        out = self.metered(p_work, p_tank, self.opened(-y), fluid)
        return {"q_supply": into, "q_work": out - into, "q_tank": -out, "q_in": into, "q_out": out}


class FourTwoValve(Metering, Lapped, Component):
    r"""4/2 directional valve: joins P to B and A to T at stroke 0, P to A and B to T at stroke 1.

    .. math:: q_{jk} = C_d\, s_{jk} A \sqrt{2\rho|p_j - p_k|}/\rho_0\, \mathrm{sign}(p_j - p_k), \quad
              s_{PA} = s_{BT} = s(y), \quad s_{PB} = s_{AT} = s(-y), \quad y = 2 x - 1

    p [Pa] of supply P, work ports A and B, tank T; x = `stroke` [-], counted within 0 and 1; s(y) [-], A = `area` of
    each edge [m^2], C_d [-], \rho [kg/m^3] as in `two_two_valve`, u = `overlap` [-] being 0 by default. At either end
    of the stroke the two edges that are not meant pass nothing, for any u > w - 1. On the way through the middle all
    edges are closed within the overlap, or all open where it is negative; in between, at u = 0, they are open by a
    quarter of `edge_rounding`. A `four_three_valve` between strokes of -1 and 1 does the same; unequal edges are there.
    Not for leakage, nor for cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, four-way spool valve; ISO 1219-1, 4/2 valve.
    """

    supply = takes_pressure("supply port P")
    a = takes_pressure("work port A")
    b = takes_pressure("work port B")
    tank = takes_pressure("tank port T")
    stroke = takes_signal(Ratio, "0 joins P with B and A with T, 1 P with A and B with T", low=0, high=1)
    q_supply_a = observable(Flow, "flow from P to A")
    q_supply_b = observable(Flow, "flow from P to B")
    q_a_tank = observable(Flow, "flow from A to T")
    q_b_tank = observable(Flow, "flow from B to T")
    loss = dissipates()

    def equations(self, p_supply: Expr, p_a: Expr, p_b: Expr, p_tank: Expr, stroke: Expr, fluid: Fluid) -> Equations:
        y = 2 * stroke - 1
        straight, crossed = self.opened(y), self.opened(-y)
        p_to_a = self.metered(p_supply, p_a, straight, fluid)
        b_to_t = self.metered(p_b, p_tank, straight, fluid)
        p_to_b = self.metered(p_supply, p_b, crossed, fluid)
        a_to_t = self.metered(p_a, p_tank, crossed, fluid)
        return {
            "q_supply": p_to_a + p_to_b,
            "q_a": a_to_t - p_to_a,
            "q_b": b_to_t - p_to_b,
            "q_tank": -a_to_t - b_to_t,
            "q_supply_a": p_to_a,
            "q_supply_b": p_to_b,
            "q_a_tank": a_to_t,
            "q_b_tank": b_to_t,
        }


class FourThreeValve(Metering, Lapped, Component):
    r"""4/3 proportional directional valve with four edges.

    .. math:: q_{jk} = C_d\, s\, A_{jk} \sqrt{2\rho|p_j - p_k|}/\rho_0\, \mathrm{sign}(p_j - p_k), \quad
              s_{PA} = s(x, u), \; s_{BT} = s(x, u_T), \; s_{PB} = s(-x, u), \; s_{AT} = s(-x, u_T)

    x = `stroke` [-], counted within -1 and 1: above 0 P feeds A and B returns to T, below 0 P feeds B and A returns; p
    [Pa]; s(x, u) = (x - u)/(1 - u) [-], 0 below the overlap u, its corner rounded within `edge_rounding` as in
    `two_two_valve`; u = `overlap` [-] of the edges at P, u_T = `tank_overlap` [-] of those at T; A = `area` [m^2], at
    port B times `area_ratio` [-]; C_d [-] follows the flow number as there; \rho [kg/m^3] at the mean pressure, \rho_0
    at 0 bar gauge. With a critical centre, equal edges and a load p_L = p_A - p_B on equal flows this is the textbook's
    q = C_d s A sqrt((p_s - sign(x) p_L)/\rho) for p_T = 0. The centre is closed for overlaps from `edge_rounding` on;
    critical at 0, where each edge is open by a quarter of that; open (all ports joined) for overlaps below 0; float (A
    and B to T, P closed) for `tank_overlap` alone below 0; P joined to A and B for `overlap` alone below 0; tandem (P
    to T, A and B closed) for overlaps above 0 and a `tandem_area` A_PT [m^2], open by s_PT = (c - |x|)/c [-] up to c =
    `tandem_stroke` [-], with corners as of the edges. Not for leakage, nor for cavitating flow.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, four-way spool valve; ISO 1219-1, centres.
    """

    tank_overlap: Ratio | None = Field(
        default=None, gt=-1, lt=1, description="overlap of the edges at the tank port; default: overlap"
    )
    area_ratio: Ratio = Field(default=1.0, gt=0, description="area of the edges at port B over that at port A")
    tandem_area: Area = Field(default=0.0, ge=0, description="flow area from P to T in the middle; 0: no tandem centre")
    tandem_stroke: Ratio = Field(default=0.1, gt=0, le=1, description="stroke at which P is parted from T again")

    supply = takes_pressure("supply port P")
    a = takes_pressure("work port A")
    b = takes_pressure("work port B")
    tank = takes_pressure("tank port T")
    stroke = takes_signal(Ratio, "above 0 joins P with A and B with T, below 0 P with B and A with T", low=-1, high=1)
    q_supply_a = observable(Flow, "flow from P to A")
    q_supply_b = observable(Flow, "flow from P to B")
    q_a_tank = observable(Flow, "flow from A to T")
    q_b_tank = observable(Flow, "flow from B to T")
    q_supply_tank = observable(Flow, "flow from P to T")
    loss = dissipates()

    def equations(self, p_supply: Expr, p_a: Expr, p_b: Expr, p_tank: Expr, stroke: Expr, fluid: Fluid) -> Equations:
        tank_overlap = self.overlap if self.tank_overlap is None else self.tank_overlap
        area_b = self.area_ratio * self.area

        def returned(x: Any) -> Any:
            return edge_share(x, tank_overlap, self.edge_rounding)

        p_to_a = self.metered(p_supply, p_a, self.opened(stroke), fluid)
        p_to_b = self.through(p_supply, p_b, area_b * self.opened(-stroke), fluid)
        a_to_t = self.metered(p_a, p_tank, returned(-stroke), fluid)
        b_to_t = self.through(p_b, p_tank, area_b * returned(stroke), fluid)
        middle = self.tandem_area * middle_share(stroke, self.tandem_stroke, self.edge_rounding)
        p_to_t = self.through(p_supply, p_tank, middle, fluid)
        return {
            "q_supply": p_to_a + p_to_b + p_to_t,
            "q_a": a_to_t - p_to_a,
            "q_b": b_to_t - p_to_b,
            "q_tank": -a_to_t - b_to_t - p_to_t,
            "q_supply_a": p_to_a,
            "q_supply_b": p_to_b,
            "q_a_tank": a_to_t,
            "q_b_tank": b_to_t,
            "q_supply_tank": p_to_t,
        }
