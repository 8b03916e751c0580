"""Parts of spool valves: faces under pressure, holes, lands. Join them on the rod of a mass to make a valve."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_signal,
    observable,
    supplies,
    takes_motion,
    takes_pressure,
    takes_signal,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, acos, maximum, minimum, pi, sqrt
from crescentlab.units import Area, Flow, FlowResistance, Force, Length, Pressure, QuadraticResistance, Ratio

from .flow_laws import annular_flow, drag_flow, referred_flow
from .valve_laws import SpoolEdge, Uncovered

Side = Literal["pushes_up", "pushes_down"]
"""Whether the pressure on a face pushes the spool towards increasing x or decreasing x."""


def circle_segment(height: Any, diameter: Any, rounding: Any) -> tuple[Any, Any]:
    r"""Area [m^2] and hydraulic diameter [m] of a circle uncovered up to `height` [m] by a straight edge.

    .. math:: A = r^2 (\alpha - \sin\alpha \cos\alpha), \quad d_h = \frac{4A}{2r(\alpha + \sin\alpha)}, \quad
              \cos\alpha = 1 - h/r

    \alpha [rad] half the angle of the arc; r = `diameter`/2 [m]; h [m], counted as 0 below 0 and as the diameter
    above it. Over the first and last `rounding` w [m] the area grows as 1.5 s^2 - 0.5 s^3, s = h/w, times its
    value at w (exact from w on, with equal slope), where the exact law has an infinite second derivative.
    """
    r = diameter / 2

    def exact(h: Any) -> tuple[Any, Any]:
        cosine = 1 - h / r
        alpha, sine = acos(cosine), sqrt(1 - cosine * cosine)
        return r * r * (alpha - sine * cosine), 2 * r * (alpha + sine)

    def missing(h: Any) -> Any:
        s = minimum(maximum(h / rounding, 0.0), 1.0)
        return 1 - s * s * (1.5 - 0.5 * s)

    edge, _ = exact(rounding)
    inner, perimeter = exact(minimum(maximum(height, rounding), diameter - rounding))
    area = inner - edge * missing(height) + edge * missing(diameter - height)
    return area, 4 * area / perimeter


def circle_chord(height: Any, diameter: Any, rounding: Any) -> Any:
    r"""Slope [m] of the area of :func:`circle_segment` over `height` [m]: the edge's length within the circle.

    .. math:: \frac{dA}{dh} = 2 \sqrt{h (d - h)}

    d = `diameter` [m]; 0 at h = 0 and h = d. Over the first and last `rounding` w [m] it is the chord at w times 2 s -
    s^2, s = h/w, which is the area's slope there but for a share of w/(5 d).
    """
    inner = minimum(maximum(height, rounding), diameter - rounding)

    def share(h: Any) -> Any:
        s = minimum(maximum(h / rounding, 0.0), 1.0)
        return s * (2 - s)

    return 2 * sqrt(inner * (diameter - inner)) * share(height) * share(diameter - height)


def _up(side: Side) -> float:
    return 1.0 if side == "pushes_up" else -1.0


class SpoolEnd(Component):
    r"""Face of a spool or piston under the pressure of its port, moving fluid as it moves.

    .. math:: F = \pm p A, \quad q = \pm \frac{\rho(p)}{\rho_0} A v, \quad A = \frac{\pi}{4} (D^2 - d^2)

    F [N] on the spool, + for `side` pushes_up; p [Pa, gauge]; q [m^3/s] into the face's chamber; v [m/s];
    D = `diameter`, d = `rod_diameter` [m]. Not for leakage (`leakage_land`), nor for the compressibility of the
    chamber, which belongs to the capacity on the net. Source: definition of pressure; displacement of a piston.
    """

    diameter: Length = Field(gt=0, description="diameter of the face")
    rod_diameter: Length = Field(default=0.0, ge=0, description="diameter of a rod that leaves through the face")
    side: Side = Field(default="pushes_up", description="where the pressure pushes: pushes_up is towards increasing x")

    port = takes_pressure("pressure on the face")
    rod = takes_motion("the spool")
    force = observable(Force, "pressure force on the spool, positive towards increasing x")
    loss = dissipates()

    @model_validator(mode="after")
    def _face_has_area(self) -> Self:
        if self.rod_diameter >= self.diameter:
            raise ValueError(
                f"rod_diameter ({self.rod_diameter * 1e3:g} mm) must be smaller than "
                f"diameter ({self.diameter * 1e3:g} mm)"
            )
        return self

    def equations(self, p_port: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        area = _up(self.side) * pi / 4 * (self.diameter**2 - self.rod_diameter**2)
        force = p_port * area
        return {"q_port": referred_flow(area * v_rod, p_port, fluid), "f_rod": -force, "force": force}


class SpringChamberEnd(Component):
    r"""Face of a spool under a pressure given by a signal; the fluid it displaces goes to its port.

    .. math:: F = \pm p_c A, \quad q = \pm \frac{\rho(p)}{\rho_0} A v, \quad A = \frac{\pi}{4} D^2

    F [N] on the spool, - for `side` pushes_down; p_c [Pa, gauge] the signal `pressure`; p [Pa, gauge] of the port;
    q [m^3/s] into the face's chamber; v [m/s]; D = `diameter` [m]. Not for a chamber whose pressure follows from
    its flows: use `spool_end` on a capacity. Source: Rundo & Corvaglia (2016), sections 4.1 and 4.2.
    """

    diameter: Length = Field(gt=0, description="diameter of the face")
    side: Side = Field(
        default="pushes_down", description="where the pressure pushes: pushes_up is towards increasing x"
    )

    pressure = takes_signal(Pressure, "gauge pressure on the face")
    port = takes_pressure("where the displaced fluid goes")
    rod = takes_motion("the spool")
    force = observable(Force, "pressure force on the spool, positive towards increasing x")
    supply = supplies("power that the given pressure takes from or adds to the fluid")

    def equations(self, pressure: Expr, p_port: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        area = _up(self.side) * pi / 4 * self.diameter**2
        force = pressure * area
        return {"q_port": referred_flow(area * v_rod, p_port, fluid), "f_rod": -force, "force": force}


class RoundHoles(SpoolEdge, Component):
    r"""Round holes uncovered by the edge of a spool, with its steady and transient flow forces.

    .. math:: q = n C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              F_{jet} = k \rho_0 |q| v_{jet} \cos\vartheta, \quad v_{jet} = \sqrt{2|\Delta p|/\rho}, \quad
              F_t = L \rho_0 \frac{q}{A} \frac{dA}{dx} v, \quad \frac{dA}{dx} = 2 \sqrt{h (d - h)}

    \Delta p = p_a - p_b [Pa]; n = `number`; A [m^2] the segment of one hole of d = `diameter` [m] uncovered up to h =
    \pm x - `overlap` [m], x [m], + for `opens` up; C_d(\lambda) = `cd_max` tanh(2\lambda/`lambda_c`) with the hydraulic
    diameter 4 A/perimeter of one segment [m]; \rho [kg/m^3], \nu [m^2/s] at the mean pressure, \rho_0 at 0 bar gauge;
    \vartheta = `jet_angle` [rad] to the spool's axis; k = `jet_coefficient` [-]. F_jet [N] closes whichever way the
    fluid flows; v_jet is rounded within `drop_rounding` [Pa] of zero drop. F_t [N] acts against v [m/s] of the rod
    where the fluid flows from a to b, L = `damping_length` [m] as in `annular_port`; its part with dp/dt is left out.
    Closed for h <= 0; fully open, without F_t, for h >= d. Not for cavitating flow, nor for an axial inlet's momentum
    (lower k).
    Source: Rundo & Corvaglia (2016), Eqs. 27-29 and 31; H. E. Merritt, Hydraulic Control Systems (1967), chapter 5,
    flow forces on spool valves.
    """

    number: int = Field(default=1, ge=1, description="number of holes")
    diameter: Length = Field(gt=0, description="diameter of a hole")
    edge_rounding: Length = Field(default=1e-6, gt=0, description="rounding of a hole's area where it starts or ends")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    rod = takes_motion("the spool")
    flow = gives_signal(Flow, "flow from a to b")
    q = observable(Flow, "flow from a to b")
    area = observable(Area, "open area of all holes")
    jet_force = observable(Force, "steady flow force, positive towards closing")
    transient_force = observable(Force, "transient flow force, positive towards decreasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        h = self.travel(x_rod)
        segment, hydraulic_diameter = circle_segment(h, self.diameter, self.edge_rounding)
        chord = circle_chord(h, self.diameter, self.edge_rounding)
        uncovered = Uncovered(self.number * segment, self.number * chord, hydraulic_diameter)
        passed = self.issued(uncovered, p_a, p_b, v_rod, fluid)
        return {**passed, "flow": passed["q"]}


class LeakageLand(Component):
    r"""Leakage along a spool's land and the viscous drag on it; the overlap changes with the stroke.

    .. math:: q = \frac{\rho}{\rho_0} \left(\frac{\pi d c^3 (1 + 1.5\varepsilon^2)}{12 \mu l} \Delta p
              + \frac{\pi d c}{2} v\right), \quad
              F = \frac{\pi d \mu l}{c} v - \frac{\pi d c}{2} \Delta p, \quad l = l_0 \pm x

    \Delta p = p_a - p_b [Pa]; q [m^3/s] from a to b, which lies towards increasing x; F [N] on the spool towards
    decreasing x; d = `diameter`, c = `clearance` (radial), l_0 = `overlap` at x = 0 [m], l not below `shortest`;
    \varepsilon = `eccentricity`; \mu [Pa s], \rho [kg/m^3] at the mean pressure, \rho_0 at 0 bar gauge; v [m/s]. The
    drag is that of a centred spool. Not for a land that has opened: put holes or an orifice beside it. Source: Rundo &
    Corvaglia (2016), Eq. 23; plane Couette-Poiseuille flow wrapped round the spool.
    """

    diameter: Length = Field(gt=0, description="diameter of the land")
    clearance: Length = Field(gt=0, description="radial clearance")
    overlap: Length = Field(description="length of the gap at x = 0")
    shortest: Length = Field(default=1e-4, gt=0, description="length below which the gap does not shrink")
    eccentricity: Ratio = Field(default=0.0, ge=0, le=1, description="offset of the spool over the radial clearance")
    opens: Literal["up", "down", "never"] = Field(default="up", description="where the overlap shrinks: up is l_0 - x")

    a = takes_pressure("end towards decreasing x")
    b = takes_pressure("end towards increasing x")
    rod = takes_motion("the spool")
    q = observable(Flow, "flow from a to b")
    length = observable(Length, "length of the gap")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        growth = {"up": -1.0, "down": 1.0, "never": 0.0}[self.opens]
        length = maximum(self.overlap + growth * x_rod, self.shortest)
        width = pi * self.diameter
        q = annular_flow(p_a, p_b, self.diameter, self.clearance, self.eccentricity, length, fluid)
        q = q + drag_flow(p_a, p_b, v_rod, width, self.clearance, fluid)
        shear = fluid.dynamic_viscosity((p_a + p_b) / 2) * length * v_rod / self.clearance
        drag = width * (shear - self.clearance / 2 * (p_a - p_b))
        return {"q_a": q, "q_b": -q, "f_rod": drag, "q": q, "length": length}


class SpringChamberPressure(Component):
    r"""Back pressure in a spring chamber as a second-order polynomial of the flow through the valve.

    .. math:: p_c = a Q + b Q^2 \text{ for } Q > 0, \quad p_c = 0 \text{ otherwise}

    p_c [Pa, gauge]; Q [m^3/s] volume flow at 0 bar gauge, behind the valve: the flow that a `round_holes` signals, mass
    flow over \rho_0; a = `linear` [Pa s/m^3]; b = `quadratic` [Pa s^2/m^6]. Not a resistance: no fluid passes here.
    Source: Rundo & Corvaglia (2016), section 4.2 and Fig. 14.
    """

    linear: FlowResistance = Field(default=0.0, ge=0, description="pressure per flow")
    quadratic: QuadraticResistance = Field(default=0.0, ge=0, description="pressure per flow squared")

    flow = takes_signal(Flow, "flow through the valve, as volume at 0 bar gauge")
    pressure = gives_signal(Pressure, "gauge pressure in the chamber")

    def equations(self, flow: Expr) -> Equations:
        forward = maximum(flow, 0.0)
        return {"pressure": self.linear * forward + self.quadratic * forward**2}
