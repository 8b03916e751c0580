"""Cylinders with their chambers, and the cushions at their ends. Mass, friction and load are parts beside them."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_pressure,
    observable,
    reads_motion,
    state,
    stores,
    stores_energy,
    takes_motion,
    takes_pressure,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fail_when, maximum, minimum, pi, sqrt
from crescentlab.units import (
    Area,
    Damping,
    Flow,
    FlowConductance,
    Force,
    Length,
    Pressure,
    Ratio,
    Stiffness,
    Velocity,
    Volume,
)

from .flow_laws import orifice_flow, referred_flow
from .mechanics import contact_force

SMALLEST_SHARE = 1e-3
"""Share of the dead volume that a used-up chamber keeps, so that what divides by it stays finite."""

USED_UP = (
    "the piston has gone through its stop and used up a dead volume; start it within its stroke, or raise "
    "stop_stiffness or dead volumes"
)


def _stops(x: Any, v: Any, stroke: Any, stiffness: Any, restitution: Any, impact_velocity: Any) -> tuple[Any, Any, Any]:
    """Force [N] of the stops at 0 and `stroke` towards increasing x, their strain energy [J], what they lose [W]."""
    low, high = maximum(-x, 0.0), maximum(x - stroke, 0.0)
    law = (stiffness, restitution, impact_velocity)
    force = contact_force(low, -v, *law) - contact_force(high, v, *law)
    return force, stiffness * (low * low + high * high) / 2, (stiffness * (low - high) - force) * v


def _pressure_rate(p: Any, volume: Any, q: Any, swept: Any, fluid: Fluid) -> Any:
    """dp/dt [Pa/s] of a chamber with the flow `q` in and the rate of volume `swept`, both [m^3/s]."""
    return fluid.bulk_modulus(p) / volume * (fluid.rho_0 / fluid.density(p) * q - swept)


class SingleActingCylinder(Component):
    r"""Cylinder under pressure on one side, with a return spring; the other side is open to the air.

    .. math:: \frac{dp}{dt} = \frac{\beta}{V} \left(\frac{\rho_0}{\rho} q - A v\right), \quad V = V_0 + A x, \quad
              F = p A - F_0 - k x - B v + F_{stop}

    p [Pa, gauge] of the chamber; q [m^3/s] into it; F [N] on the rod's mass, towards increasing x; x [m] from 0 to
    `stroke`, v [m/s]; A = \pi d^2/4 [m^2], d = `piston_diameter` (for a plunger its own diameter); V_0 = `dead_volume`
    [m^3]; F_0 = `preload` [N], k = `spring_stiffness` [N/m]; B = `viscous_friction` [N s/m]; the stops at both ends are
    those of `elastic_end_stops`; \beta [Pa], \rho [kg/m^3] at p. Stored: V \rho/\rho_0 [m^3]; energy V e(p) + F_0 x + k
    x^2/2 [J] and the strain of the stops. Lost: B v^2 [W] and the stops' damping. Join the rod to a mass. Not for a
    housing that moves. Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 6, valve controlled piston.
    """

    piston_diameter: Length = Field(gt=0, description="diameter of the piston")
    stroke: Length = Field(gt=0, description="distance between the stops")
    dead_volume: Volume = Field(gt=0, description="volume of the chamber at x = 0, with the pipe to the valve")
    preload: Force = Field(default=0.0, ge=0, description="force of the return spring at x = 0")
    spring_stiffness: Stiffness = Field(default=0.0, ge=0, description="of the return spring")
    viscous_friction: Damping = Field(default=0.0, ge=0, description="force per velocity")
    stop_stiffness: Stiffness = Field(default=1e8, gt=0, description="of the stops, force per depth")
    restitution: Ratio = Field(default=0.5, ge=0, le=1, description="rebound from a stop over impact speed")
    impact_velocity: Velocity = Field(default=0.1, gt=0, description="impact speed at which the restitution holds")

    cap = gives_pressure("the chamber, whose pressure pushes towards increasing x")
    rod = takes_motion("the piston")
    pressure = state(Pressure, "pressure of the chamber", start=0.0, nominal=1e5)
    force = observable(Force, "force on the rod's mass, towards increasing x")
    stop_force = observable(Force, "force of the stops on the rod's mass")
    volume = observable(Volume, "volume of the chamber, negative once it would be used up")
    content = stores()
    stored_energy = stores_energy("energy of the fluid, the spring and the stops")
    loss = dissipates("power lost to friction and in the stops")

    def equations(self, pressure: Expr, q_cap: Expr, x_rod: Expr, v_rod: Expr, fluid: Fluid) -> Equations:
        area = pi / 4 * self.piston_diameter * self.piston_diameter
        volume = self.dead_volume + area * x_rod
        filled = maximum(volume, SMALLEST_SHARE * self.dead_volume)
        law = (self.stop_stiffness, self.restitution, self.impact_velocity)
        stop, strain, stop_loss = _stops(x_rod, v_rod, self.stroke, *law)
        bent = (self.preload + self.spring_stiffness * x_rod / 2) * x_rod
        spring = self.preload + self.spring_stiffness * x_rod + self.viscous_friction * v_rod
        force = pressure * area - spring + stop
        return {
            "p_cap": pressure,
            "der_pressure": _pressure_rate(pressure, filled, q_cap, area * v_rod, fluid),
            "f_rod": -force,
            "force": force,
            "stop_force": stop,
            "volume": volume,
            "content": filled * fluid.density(pressure) / fluid.rho_0,
            "stored_energy": filled * fluid.energy_density(pressure) + bent + strain,
            "loss": self.viscous_friction * v_rod * v_rod + stop_loss,
            "used_up": fail_when(volume < SMALLEST_SHARE * self.dead_volume, USED_UP),
        }


class DoubleActingCylinder(Component):
    r"""Cylinder with a chamber on each side of its piston, leakage past the piston, and stops.

    .. math:: \frac{dp_1}{dt} = \frac{\beta_1}{V_1} \left(\frac{\rho_0}{\rho_1} (q_1 - q_l) - A_1 v\right), \quad
              \frac{dp_2}{dt} = \frac{\beta_2}{V_2} \left(\frac{\rho_0}{\rho_2} (q_2 + q_l) + A_2 v\right)

    .. math:: V_1 = V_{01} + A_1 x, \quad V_2 = V_{02} + A_2 (s - x), \quad
              q_l = \frac{\rho_m}{\rho_0} G (p_1 - p_2), \quad F = p_1 A_1 - p_2 A_2 - B v + F_{stop}

    1 is the cap's side, 2 the rod's; p [Pa, gauge]; q [m^3/s] into the chambers; x [m] of the rod from 0 to s =
    `stroke`, v [m/s]; F [N] on the rod's mass, towards increasing x; A = \pi (d^2 - d_r^2)/4 [m^2] with d =
    `piston_diameter`, d_r = `rod_diameter` on side 2, `cap_rod_diameter` on side 1 (a rod through both ends); V_0 dead
    volumes [m^3]; G = `leakage_conductance` [m^3/(s Pa)]; B = `viscous_friction` [N s/m]; the stops are those of
    `elastic_end_stops`; \beta [Pa], \rho [kg/m^3] of each chamber, \rho_m at the mean of both pressures. Stored: the
    sum of V \rho/\rho_0 [m^3]; energy V_1 e(p_1) + V_2 e(p_2) [J] and the strain of the stops. Lost: B v^2, the
    leakage's \rho_0 q_l (w(p_1) - w(p_2)) [W] and the stops' damping. Join the rod to a mass, dry friction beside it
    (`friction_between`, `stick_slip_mass`), and cushions between chamber and pipe (`cushion`). Not for a housing that
    moves. Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 6, valve controlled piston.
    """

    piston_diameter: Length = Field(gt=0, description="diameter of the piston")
    rod_diameter: Length = Field(default=0.0, ge=0, description="diameter of the rod")
    cap_rod_diameter: Length = Field(default=0.0, ge=0, description="diameter of a rod through the cap, 0 is none")
    stroke: Length = Field(gt=0, description="distance between the stops")
    cap_dead_volume: Volume = Field(gt=0, description="volume on the cap's side at x = 0, with its pipe")
    rod_dead_volume: Volume = Field(gt=0, description="volume on the rod's side at x = stroke, with its pipe")
    leakage_conductance: FlowConductance = Field(default=0.0, ge=0, description="flow past the piston per drop")
    viscous_friction: Damping = Field(default=0.0, ge=0, description="force per velocity")
    stop_stiffness: Stiffness = Field(default=1e8, gt=0, description="of the stops, force per depth")
    restitution: Ratio = Field(default=0.5, ge=0, le=1, description="rebound from a stop over impact speed")
    impact_velocity: Velocity = Field(default=0.1, gt=0, description="impact speed at which the restitution holds")

    cap = gives_pressure("chamber of the cap, whose pressure pushes towards increasing x")
    annulus = gives_pressure("chamber of the rod, whose pressure pushes towards decreasing x")
    rod = takes_motion("the piston")
    cap_pressure = state(Pressure, "pressure on the cap's side", start=0.0, nominal=1e5)
    annulus_pressure = state(Pressure, "pressure on the rod's side", start=0.0, nominal=1e5)
    force = observable(Force, "force on the rod's mass, towards increasing x")
    stop_force = observable(Force, "force of the stops on the rod's mass")
    leakage = observable(Flow, "flow past the piston, from cap to rod")
    smallest = observable(Volume, "volume of the smaller chamber, negative once it would be used up")
    content = stores()
    stored_energy = stores_energy("energy of the fluid in both chambers and of the stops")
    loss = dissipates("power lost to friction, leakage and in the stops")

    @model_validator(mode="after")
    def _rods_are_thinner(self) -> Self:
        for name in ("rod_diameter", "cap_rod_diameter"):
            if getattr(self, name) >= self.piston_diameter:
                raise ValueError(
                    f"{name} ({getattr(self, name) * 1e3:g} mm) must be smaller than "
                    f"piston_diameter ({self.piston_diameter * 1e3:g} mm)"
                )
        return self

    def equations(
        self, cap_pressure: Expr, annulus_pressure: Expr, q_cap: Expr, q_annulus: Expr, x_rod: Expr, v_rod: Expr,
        fluid: Fluid,
    ) -> Equations:  # fmt: skip
        """Rates of both pressures, and the force on the rod."""
        p_1, p_2 = cap_pressure, annulus_pressure
        area_1, area_2 = self._ring(self.cap_rod_diameter), self._ring(self.rod_diameter)
        left_1 = self.cap_dead_volume + area_1 * x_rod
        left_2 = self.rod_dead_volume + area_2 * (self.stroke - x_rod)
        V_1 = maximum(left_1, SMALLEST_SHARE * self.cap_dead_volume)
        V_2 = maximum(left_2, SMALLEST_SHARE * self.rod_dead_volume)
        law = (self.stop_stiffness, self.restitution, self.impact_velocity)
        stop, strain, stop_loss = _stops(x_rod, v_rod, self.stroke, *law)
        force = p_1 * area_1 - p_2 * area_2 - self.viscous_friction * v_rod + stop
        leakage = referred_flow(self.leakage_conductance * (p_1 - p_2), (p_1 + p_2) / 2, fluid)
        throttled = fluid.rho_0 * leakage * (fluid.enthalpy(p_1) - fluid.enthalpy(p_2))
        used = (left_1 < SMALLEST_SHARE * self.cap_dead_volume) | (left_2 < SMALLEST_SHARE * self.rod_dead_volume)
        return {
            "p_cap": p_1,
            "p_annulus": p_2,
            "der_cap_pressure": _pressure_rate(p_1, V_1, q_cap - leakage, area_1 * v_rod, fluid),
            "der_annulus_pressure": _pressure_rate(p_2, V_2, q_annulus + leakage, -area_2 * v_rod, fluid),
            "f_rod": -force,
            "force": force,
            "stop_force": stop,
            "leakage": leakage,
            "smallest": minimum(left_1, left_2),
            "content": (V_1 * fluid.density(p_1) + V_2 * fluid.density(p_2)) / fluid.rho_0,
            "stored_energy": V_1 * fluid.energy_density(p_1) + V_2 * fluid.energy_density(p_2) + strain,
            "loss": self.viscous_friction * v_rod * v_rod + throttled + stop_loss,
            "used_up": fail_when(used, USED_UP),
        }

    def _ring(self, rod: Any) -> Any:
        """Area [m^2] of the piston round a rod."""
        return pi / 4 * (self.piston_diameter * self.piston_diameter - rod * rod)


class Cushion(Component):
    r"""Cushion of a cylinder: the way out of a chamber narrows as the piston nears the end of its stroke.

    .. math:: q = C_d A(z) \sqrt{2\rho|\Delta p|}/\rho_0\; \mathrm{sign}\,\Delta p, \quad
              A = A_r + (A_0 - A_r) z \ \text{(linear)} \quad \text{or} \quad
              A = \sqrt{A_r^2 + (A_0^2 - A_r^2) z} \ \text{(constant\_deceleration)}

    z [-] = distance of the rod from `end` over `length`, within 0 and 1; A_0 = `area` [m^2] ahead of the cushion, A_r =
    `remaining_area` [m^2] at the end; \Delta p [Pa] chamber less port; C_d and \rho [kg/m^3] as in `orifice`. With the
    second profile an outflow proportional to the root of z, which is a piston of constant deceleration, has a constant
    drop. A check valve beside it, from port to chamber, lets the piston start quickly. Finite Jacobian at all z and at
    zero drop. Not for cavitating flow. Source: orifice equation; H. Murrenhoff, Grundlagen der Fluidtechnik, Teil 1:
    Hydraulik (2011), end-position cushioning of cylinders.
    """

    area: Area = Field(gt=0, description="flow area ahead of the cushion")
    remaining_area: Area = Field(gt=0, description="flow area at the end of the stroke, the cushion's throttle")
    length: Length = Field(gt=0, description="length of the cushion")
    end: Length = Field(default=0.0, description="position of the rod at the end of the stroke")
    towards: Literal["low", "high"] = Field(default="low", description="direction of the stroke that is cushioned")
    profile: Literal["linear", "constant_deceleration"] = Field(
        default="linear", description="how the flow area falls with the distance from the end"
    )
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")

    chamber = takes_pressure("chamber of the cylinder")
    port = takes_pressure("the pipe")
    rod = reads_motion("the piston")
    q = observable(Flow, "flow from the chamber to the port")
    open_area = observable(Area, "flow area")
    loss = dissipates()

    @model_validator(mode="after")
    def _narrows(self) -> Self:
        if self.remaining_area > self.area:
            raise ValueError(
                f"remaining_area ({self.remaining_area * 1e6:g} mm^2) must not exceed area ({self.area * 1e6:g} mm^2)"
            )
        return self

    def equations(self, p_chamber: Expr, p_port: Expr, x_rod: Expr, fluid: Fluid) -> Equations:
        distance = x_rod - self.end if self.towards == "low" else self.end - x_rod
        z = minimum(maximum(distance / self.length, 0.0), 1.0)
        least, most = self.remaining_area, self.area
        if self.profile == "linear":
            area = least + (most - least) * z
        else:
            area = sqrt(least * least + (most * most - least * least) * z)
        q = orifice_flow(p_chamber, p_port, area, None, self.cd_max, self.lambda_c, fluid)
        return {"q_chamber": q, "q_port": -q, "q": q, "open_area": area}
