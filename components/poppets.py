"""Poppets on their seats and the flapper before its nozzle. Join them on the rod of a mass, with springs and faces."""

from typing import Any, Literal, Self

from pydantic import BaseModel, Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_motion, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, cos, maximum, minimum, pi, sin, sqrt
from crescentlab.units import Angle, Area, Flow, Force, Length, Ratio

from .flow_laws import orifice_flow, referred_flow
from .valve_laws import Jet, opening


class Seat(BaseModel):
    """The seat under a poppet, and the face of the poppet outside the seat."""

    seat_diameter: Length = Field(gt=0, description="diameter of the seat's edge, the bore under the poppet")
    face_diameter: Length | None = Field(
        default=None, gt=0, description="diameter of the face that lifts, under b outside the seat; default: the seat's"
    )
    seat_position: Length = Field(default=0.0, description="position of the rod at which the poppet sits")

    @model_validator(mode="after")
    def _face_covers_the_seat(self) -> Self:
        if self.face_diameter is not None and self.face_diameter < self.seat_diameter:
            raise ValueError(
                f"face_diameter ({self.face_diameter * 1e3:g} mm) must be at least "
                f"seat_diameter ({self.seat_diameter * 1e3:g} mm)"
            )
        return self

    @property
    def bore(self) -> Any:
        """Area of the seat's bore [m^2]."""
        return pi / 4 * self.seat_diameter * self.seat_diameter

    @property
    def ring(self) -> Any:
        """Area of the face outside the seat [m^2]."""
        if self.face_diameter is None:
            return 0.0
        return pi / 4 * self.face_diameter * self.face_diameter - self.bore


class _Poppet(Jet, Seat):
    """What every poppet returns, from what it has uncovered and the jet's angle to the axis."""

    def lifted(
        self, area: Any, hydraulic_diameter: Any, cosine: Any, p_a: Any, p_b: Any, v_rod: Any, fluid: Fluid
    ) -> Equations:  # fmt: skip
        """Flows and force; the seat never passes more than its bore."""
        passed = minimum(area, self.bore)
        issue = self.jet(p_a, p_b, passed, hydraulic_diameter, cosine, fluid)
        force = p_a * self.bore + p_b * self.ring - issue.force
        return {
            "q_a": issue.q + referred_flow(self.bore * v_rod, p_a, fluid),
            "q_b": -issue.q + referred_flow(self.ring * v_rod, p_b, fluid),
            "f_rod": -force,
            "q": issue.q,
            "area": passed,
            "jet_force": issue.force,
            "force": force,
        }


class ConicalPoppet(_Poppet, Component):
    r"""Conical poppet on a sharp-edged seat.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              A = \pi x \sin\alpha\, (d - x \sin\alpha \cos\alpha), \quad
              F = p_a A_s + p_b A_r - F_{jet}, \quad F_{jet} = k \rho_0 |q| v_{jet} \cos\alpha

    \Delta p = p_a - p_b [Pa]; x [m] lift of the rod above `seat_position`; d = `seat_diameter`; \alpha = `half_angle`
    [rad] of the cone, along which the jet leaves; A at most the bore A_s = \pi d^2/4 [m^2]; A_r [m^2] the face outside
    the seat, up to `face_diameter`; C_d [-] follows the flow number as in `orifice`, with the hydraulic diameter 2 x
    \sin\alpha up to the lift of the largest A; v_jet = \sqrt{2|\Delta p|/\rho} [m/s]; \rho [kg/m^3], \nu [m^2/s] at the
    mean pressure, \rho_0 at 0 bar gauge; k = `jet_coefficient` [-]. F [N] on the poppet, towards increasing x. F_jet
    closes whichever way the fluid flows, for k = 1; a deflecting rim makes k smaller, or negative: it opens. Left out:
    the momentum in the bore, which opens. The poppet takes in A_s v at a and A_r v at b. Its back is a `spool_end`, its
    seat the stop of the mass. Not for seats with a chamfer wider than the lift, nor for cavitating flow.
    Source: D. McCloy, H. R. Martin, Control of Fluid Power (1980), poppet valves; geometry of a cone's frustum.
    """

    half_angle: Angle = Field(default=pi / 4, gt=0, lt=pi / 2, description="angle of the cone's surface to its axis")

    a = takes_pressure("bore under the seat")
    b = takes_pressure("round the poppet")
    rod = takes_motion("the poppet; it opens towards increasing x")
    q = observable(Flow, "flow over the seat from a to b")
    area = observable(Area, "open area")
    jet_force = observable(Force, "flow force, positive towards closing")
    force = observable(Force, "force of the fluid on the face, positive towards opening")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        sine, cosine = sin(self.half_angle), cos(self.half_angle)
        lift, _ = opening(x_rod - self.seat_position, self.edge_rounding)
        x = minimum(lift, self.seat_diameter / (2 * sine * cosine))
        area = pi * x * sine * (self.seat_diameter - x * sine * cosine)
        return self.lifted(area, 2 * x * sine, cosine, p_a, p_b, v_rod, fluid)


class BallPoppet(_Poppet, Component):
    r"""Ball on a sharp-edged seat.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              A = \pi r \frac{x (2 h_0 + x)}{l}, \quad l = \sqrt{r^2 + (h_0 + x)^2}, \quad h_0 = \sqrt{R^2 - r^2}

    \Delta p = p_a - p_b [Pa]; x [m] lift of the rod above `seat_position`; R = `ball_diameter`/2 [m], r =
    `seat_diameter`/2 [m]; l [m] from the seat's edge to the middle of the ball. A [m^2], the cone between the edge and
    the ball's nearest circle, is at most the seat's bore. The jet leaves along the ball, at the angle of cosine r/l to
    the axis. Hydraulic diameter 2 (l - R) [m]; \rho [kg/m^3]; discharge coefficient, forces [N] and all else as in
    `conical_poppet`. Not for a ball that swings to the side, nor for cavitating flow.
    Source: D. McCloy, H. R. Martin, Control of Fluid Power (1980), poppet valves; geometry of a cone's frustum.
    """

    ball_diameter: Length = Field(gt=0, description="diameter of the ball, larger than the seat's")

    a = takes_pressure("bore under the seat")
    b = takes_pressure("round the ball")
    rod = takes_motion("the ball; it opens towards increasing x")
    q = observable(Flow, "flow over the seat from a to b")
    area = observable(Area, "open area")
    jet_force = observable(Force, "flow force, positive towards closing")
    force = observable(Force, "force of the fluid on the face, positive towards opening")
    loss = dissipates()

    @model_validator(mode="after")
    def _ball_covers_the_seat(self) -> Self:
        if self.ball_diameter <= self.seat_diameter:
            raise ValueError(
                f"ball_diameter ({self.ball_diameter * 1e3:g} mm) must be larger than "
                f"seat_diameter ({self.seat_diameter * 1e3:g} mm)"
            )
        return self

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        ball, seat = self.ball_diameter / 2, self.seat_diameter / 2
        height = sqrt(ball * ball - seat * seat)
        x, _ = opening(x_rod - self.seat_position, self.edge_rounding)
        far = sqrt(seat * seat + (height + x) * (height + x))
        risen = x * (2 * height + x)
        area, hydraulic_diameter = pi * seat * risen / far, 2 * risen / (far + ball)
        return self.lifted(area, hydraulic_diameter, seat / far, p_a, p_b, v_rod, fluid)


class FlapperNozzle(Component):
    r"""Nozzle before a flapper (baffle), and the force of its jet.

    .. math:: q = C_d A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad A = \pi d h, \quad
              F = A_N \left( \Delta p + \frac{\rho_0^2 q^2}{2 \rho A_N^2} \right), \quad A_N = \frac{\pi}{4} d^2

    \Delta p = p_a - p_b [Pa]; d = `diameter` [m]; h = `gap` \pm x [m], x [m] of the flapper, + where the nozzle's jet
    `pushes_up`, towards increasing x; h < 0 is closed; A at most A_N [m^2], from h = d/4 on the nozzle itself meters.
    C_d [-] follows the flow number as in `orifice`, with the hydraulic diameter 2 h; \rho [kg/m^3], \nu [m^2/s] at the
    mean pressure, \rho_0 at 0 bar gauge. F [N] on the flapper, away from the nozzle: in the curtain's range A_N \Delta
    p (1 + 16 C_d^2 h^2/d^2); the second term is left out for flow into the nozzle. Two nozzles that face each other,
    one pushing up and one down, make a double flapper. Not for nozzles with a rim wider than the gap, nor for
    cavitating flow. Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5, flow forces on flapper valves.
    """

    diameter: Length = Field(gt=0, description="bore of the nozzle")
    gap: Length = Field(default=0.0, description="distance of the flapper from the nozzle at x = 0")
    side: Literal["pushes_up", "pushes_down"] = Field(
        default="pushes_up", description="where the jet pushes the flapper: pushes_up is towards increasing x"
    )
    cd_max: Ratio = Field(default=0.64, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    edge_rounding: Length = Field(default=1e-6, gt=0, description="gap over which the area begins to grow")

    a = takes_pressure("behind the nozzle")
    b = takes_pressure("round the flapper")
    rod = takes_motion("the flapper")
    q = observable(Flow, "flow out of the nozzle")
    area = observable(Area, "open area")
    force = observable(Force, "force on the flapper, positive towards increasing x")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, x_rod: Expr, fluid: Fluid) -> Equations:
        sign = 1.0 if self.side == "pushes_up" else -1.0
        h, _ = opening(self.gap + sign * x_rod, self.edge_rounding)
        nozzle = pi / 4 * self.diameter * self.diameter
        area = minimum(pi * self.diameter * h, nozzle)
        q = orifice_flow(p_a, p_b, area, 2 * h, self.cd_max, self.lambda_c, fluid)
        mass_flux = fluid.rho_0 * maximum(q, 0.0) / nozzle
        force = sign * nozzle * (p_a - p_b + mass_flux * mass_flux / (2 * fluid.density((p_a + p_b) / 2)))
        return {"q_a": q, "q_b": -q, "f_rod": -force, "q": q, "area": area, "force": force}
