"""Translational mechanics: masses, springs, dampers, friction, contacts, forces, imposed motion. No fluid here."""

from typing import Any, Self

from pydantic import Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_motion,
    held,
    observable,
    state,
    stores_energy,
    supplies,
    takes_motion,
    takes_signal,
)
from crescentlab.maths import Expr, exp, fabs, maximum, minimum, tanh, when, where
from crescentlab.units import Damping, Force, Length, Ratio, Stiffness, Velocity


class Mass(Component):
    r"""Mass free to move.

    .. math:: m \frac{dv}{dt} = \sum f, \quad \frac{dx}{dt} = v

    m = `mass` [kg]; x [m], v [m/s]; f [N] on the mass. Not for a mass that meets rigid stops (`mass_with_stops`) or
    sticks (`stick_slip_mass`). Source: Newton's second law.
    """

    mass: units.Mass = Field(gt=0, description="moving mass")

    port = gives_motion("the mass")
    x = state(Length, "position", start=0.0, nominal=1e-3)
    v = state(Velocity, "velocity", start=0.0, nominal=1e-2)
    kinetic_energy = stores_energy("kinetic energy")

    def equations(self, x: Expr, v: Expr, f_port: Expr) -> Equations:
        return {
            "x_port": x,
            "v_port": v,
            "der_x": v,
            "der_v": f_port / self.mass,
            "kinetic_energy": self.mass * v * v / 2,
        }


class MassWithStops(Component):
    r"""Mass between two rigid stops: rebounds with restitution, rests on a stop until the force pulls it off.

    .. math:: m \frac{dv}{dt} = \sum f, \quad \frac{dx}{dt} = v, \quad v^+ = -e\,v^- \text{ at a stop}

    m = `mass` [kg]; x [m], v [m/s]; f [N] on the mass; e = `restitution` [-]; stops at `low` and `high` [m].
    A rebound slower than `rest_speed` [m/s] ends at rest, so with e = 0 every hit does. A resting mass does not
    move; it leaves at v = 0 as soon as the force points away from its stop. It starts resting if it starts at
    (or beyond) a stop no faster than `rest_speed`, otherwise free. Not for elastic stops, nor for the time and
    force of an impact. Source: Newton's second law and law of impact.
    """

    mass: units.Mass = Field(gt=0, description="moving mass")
    low: Length = Field(default=0.0, description="position of the low stop")
    high: Length = Field(description="position of the high stop")
    restitution: Ratio = Field(default=0.0, ge=0, le=1, description="rebound speed over impact speed")
    rest_speed: Velocity = Field(default=1e-3, gt=0, description="a rebound slower than this ends at rest")

    port = gives_motion("the mass")
    x = state(Length, "position", start="low", nominal=1e-3)
    v = state(Velocity, "velocity", start=0.0, nominal=1e-2)
    at = held(Ratio, "-1 rests on the low stop, 1 on the high one, 0 free; -2 until the start is looked at", start=-2.0)
    kinetic_energy = stores_energy("kinetic energy")

    @model_validator(mode="after")
    def _stops_in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"high ({self.high * 1e3:g} mm) must lie above low ({self.low * 1e3:g} mm)")
        return self

    def equations(self, x: Expr, v: Expr, at: Expr, f_port: Expr) -> Equations:
        free = at == 0
        rebound = -self.restitution * v
        fast = fabs(rebound) > self.rest_speed
        slow = fabs(v) <= self.rest_speed
        rests = where(slow & (x <= self.low), -1.0, where(slow & (x >= self.high), 1.0, 0.0))
        # while it is free no force is watched: in even motion it would hover about 0
        pull = where(at == -1, f_port, where(at == 1, -f_port, -1.0))
        return {
            "x_port": x,
            "v_port": v,
            "der_x": v,
            "der_v": where(free, f_port / self.mass, 0.0),
            "kinetic_energy": self.mass * v * v / 2,
            "hits_low": when(free & (x < self.low), x=self.low, v=where(fast, rebound, 0.0), at=where(fast, 0.0, -1.0)),
            "hits_high": when(
                free & (x > self.high), x=self.high, v=where(fast, rebound, 0.0), at=where(fast, 0.0, 1.0)
            ),
            "leaves": when(pull > 0, at=0.0),
            "starts": when(
                at == -2, x=minimum(maximum(x, self.low), self.high), v=where(fabs(rests) > 0.5, 0.0, v), at=rests
            ),
        }


class Spring(Component):
    r"""Linear spring against the ground; it pushes its rod towards decreasing x.

    .. math:: F = F_0 + k x

    F [N] on the rod's mass, towards -x; F_0 = `preload` [N] at x = 0; k = `stiffness` [N/m]; x [m]. Not for a
    spring that lifts off: it pulls where F < 0. Source: Hooke's law.
    """

    stiffness: Stiffness = Field(gt=0, description="force per deflection")
    preload: Force = Field(default=0.0, description="force at x = 0")

    rod = takes_motion("the moving end")
    force = observable(Force, "spring force, positive towards decreasing x")
    stored_energy = stores_energy("strain energy, 0 at x = 0")

    def equations(self, x_rod: Expr) -> Equations:
        force = self.preload + self.stiffness * x_rod
        return {"f_rod": force, "force": force, "stored_energy": (self.preload + force) / 2 * x_rod}


class SpringBetween(Component):
    r"""Linear spring between two moving parts.

    .. math:: F = k (x_b - x_a - l_0)

    F [N] tension, pulling a towards +x and b towards -x; k = `stiffness` [N/m]; x_a, x_b [m];
    l_0 = `free_length` [m]. Not for a spring with mass, nor for one that lifts off. Source: Hooke's law.
    """

    stiffness: Stiffness = Field(gt=0, description="force per extension")
    free_length: Length = Field(default=0.0, description="x_b - x_a without force")

    a = takes_motion("first end")
    b = takes_motion("second end")
    tension = observable(Force, "spring force, positive in tension")
    stored_energy = stores_energy("strain energy")

    def equations(self, x_a: Expr, x_b: Expr) -> Equations:
        extension = x_b - x_a - self.free_length
        tension = self.stiffness * extension
        return {"f_a": -tension, "f_b": tension, "tension": tension, "stored_energy": tension * extension / 2}


class Damper(Component):
    r"""Viscous damper against the ground.

    .. math:: F = B v

    F [N] on the rod's mass, against its velocity v [m/s]; B = `coefficient` [N s/m]. Not for dry friction
    (`stick_slip_mass`). Source: definition of viscous damping.
    """

    coefficient: Damping = Field(ge=0, description="force per velocity")

    rod = takes_motion("the moving end")
    loss = dissipates()

    def equations(self, v_rod: Expr) -> Equations:
        return {"f_rod": self.coefficient * v_rod}


class DamperBetween(Component):
    r"""Viscous damper between two moving parts.

    .. math:: F = B (v_b - v_a)

    F [N] tension, pulling a towards +x and b towards -x; B = `coefficient` [N s/m]; v [m/s]. Not for dry friction
    (`friction_between`). Source: definition of viscous damping.
    """

    coefficient: Damping = Field(ge=0, description="force per difference of velocities")

    a = takes_motion("first end")
    b = takes_motion("second end")
    tension = observable(Force, "damping force, positive in tension")
    loss = dissipates()

    def equations(self, v_a: Expr, v_b: Expr) -> Equations:
        tension = self.coefficient * (v_b - v_a)
        return {"f_a": -tension, "f_b": tension, "tension": tension}


class FrictionBetween(Component):
    r"""Dry and viscous friction between two moving parts, with the Stribeck curve; creeps instead of sticking.

    .. math:: F = \left[F_c + (F_s - F_c) e^{-(v/v_s)^2}\right] \tanh\frac{v}{v_t} + B v, \quad v = v_a - v_b

    F [N] on part b towards the velocity of a, the reaction on a; F_c = `coulomb_friction`, F_s = `static_friction` [N];
    v_s = `stribeck_velocity`, v_t = `creep_velocity` [m/s], below which the friction falls to zero with the velocity;
    B = `viscous_friction` [N s/m]. Not for parts that stand still under load: they creep at up to v_t; exact sticking
    against the ground is `stick_slip_mass`. Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30
    (1994) 1083-1138; rounded at rest by a hyperbolic tangent.
    """

    coulomb_friction: Force = Field(ge=0, description="friction force while sliding")
    static_friction: Force = Field(ge=0, description="friction force at the start of sliding")
    stribeck_velocity: Velocity = Field(default=1e-2, gt=0, description="decay of static to Coulomb friction")
    creep_velocity: Velocity = Field(default=1e-4, gt=0, description="width of the rounding at rest")
    viscous_friction: Damping = Field(default=0.0, ge=0, description="force per velocity")

    a = takes_motion("first part")
    b = takes_motion("second part")
    friction = observable(Force, "friction force on b, towards the velocity of a")
    loss = dissipates()

    def equations(self, v_a: Expr, v_b: Expr) -> Equations:
        slip = v_a - v_b
        share = slip / self.stribeck_velocity
        dry = self.coulomb_friction + (self.static_friction - self.coulomb_friction) * exp(-share * share)
        friction = dry * tanh(slip / self.creep_velocity) + self.viscous_friction * slip
        return {"f_a": friction, "f_b": -friction, "friction": friction}


LEAST_RESTITUTION = 0.01
"""Less is counted as this: without any rebound at all the damping would be infinite."""


def contact_force(depth: Any, closing: Any, stiffness: Any, restitution: Any, impact_velocity: Any) -> Any:
    r"""Force [N] that pushes two touching parts apart; never pulls, and starts from zero.

    .. math:: F = k \delta (1 + a \dot\delta), \quad a v_i - \ln(1 + a v_i) = -e a v_i - \ln(1 - e a v_i)

    \delta = `depth` [m], no force below 0; \dot\delta = `closing` [m/s]; k = `stiffness` [N/m]; e = `restitution` [-]
    at the `impact_velocity` v_i [m/s], exactly, below 0.01 counted as 0.01. The second equation is m \dot\delta
    d\dot\delta/d\delta = -F, separated and integrated in and out.
    Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, with the exponent 1.
    """
    damping = impact_damping(restitution) / impact_velocity
    return stiffness * maximum(depth, 0.0) * maximum(1 + damping * closing, 0.0)


def impact_damping(restitution: Any) -> Any:
    r"""Damping w = a v_i [-] of a contact whose rebound over impact speed is e at v_i; 0 at e = 1.

    .. math:: w - \ln(1 + w) = -e w - \ln(1 - e w) \iff
              \coth m - \frac{1}{m} = \frac{1 - e}{1 + e}, \quad w = \frac{2 m}{1 + e}

    since 1 + w and 1 - e w are then m coth m + m and m coth m - m. Without the root w = 0 of the first equation, and
    without its cancellation near e = 1. Four steps of Newton's method end within 5e-15 of w; the start is within 5 %.
    Source: A. Cohen, Rheologica Acta 30 (1991) 270-273, for the start: inverse Langevin function.
    """
    e = maximum(restitution, LEAST_RESTITUTION)
    wanted = (1 - e) / (1 + e)
    m = wanted * (3 - wanted * wanted) / (1 - wanted * wanted)
    for _ in range(4):
        ratio = langevin_ratio(m)
        langevin = ratio * m
        m = m - (langevin - wanted) / (1 - langevin * langevin - 2 * ratio)
    return 2 * m / (1 + e)


def langevin_ratio(m: Any) -> Any:
    r"""(coth m - 1/m)/m for m >= 0, to rounding; below 1 by Lambert's continued fraction 1/(3 + m^2/(5 + ...))."""
    small, large = minimum(m, 1.0), maximum(m, 1.0)
    fraction: Any = 17.0
    for odd in range(15, 1, -2):
        fraction = odd + small * small / fraction
    return where(m < 1, 1 / fraction, (1 / tanh(large) - 1 / large) / large)


class ElasticEndStops(Component):
    r"""Elastic stops in the ground at both ends of a stroke.

    .. math:: F = k \delta (1 + a \dot\delta), \quad a v_i - \ln(1 + a v_i) = -e a v_i - \ln(1 - e a v_i), \quad
              \delta = x_{low} - x \text{ or } x - x_{high}

    F [N] on the rod's mass, away from the stop, for \delta > 0 and never pulling; k = `stiffness` [N/m]; e =
    `restitution` [-], rebound over impact speed of a mass that nothing else moves, at v_i = `impact_velocity` [m/s],
    below 0.01 counted as 0.01; slower impacts rebound with more of their speed (1 - 2 a v/3 to first order in a v),
    faster ones with less; stops at `low` and `high` [m]. Not for rigid stops (`mass_with_stops`).
    Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, with the exponent 1.
    """

    low: Length = Field(default=0.0, description="position of the low stop")
    high: Length = Field(description="position of the high stop")
    stiffness: Stiffness = Field(default=1e8, gt=0, description="force per depth")
    restitution: Ratio = Field(default=0.5, ge=0, le=1, description="rebound over impact speed")
    impact_velocity: Velocity = Field(default=0.1, gt=0, description="impact speed at which the restitution holds")

    rod = takes_motion("what the stops hold")
    force = observable(Force, "force of the stops on the rod's mass")
    stored_energy = stores_energy("strain energy of the stops")
    loss = dissipates()

    @model_validator(mode="after")
    def _stops_in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"high ({self.high * 1e3:g} mm) must lie above low ({self.low * 1e3:g} mm)")
        return self

    def equations(self, x_rod: Expr, v_rod: Expr) -> Equations:
        law = (self.stiffness, self.restitution, self.impact_velocity)
        low, high = maximum(self.low - x_rod, 0.0), maximum(x_rod - self.high, 0.0)
        force = contact_force(low, -v_rod, *law) - contact_force(high, v_rod, *law)
        return {
            "f_rod": -force,
            "force": force,
            "stored_energy": self.stiffness * (low * low + high * high) / 2,
            "loss": (self.stiffness * (low - high) - force) * v_rod,
        }


class ElasticContact(Component):
    r"""Elastic contact of two moving parts once the clearance between them is used up.

    .. math:: F = k \delta (1 + a \dot\delta), \quad a v_i - \ln(1 + a v_i) = -e a v_i - \ln(1 - e a v_i), \quad
              \delta = x_a + l_c - x_b

    F [N] pushes a towards -x and b towards +x, for \delta > 0 [m] and never pulling; l_c = `clearance` [m], the
    distance x_b - x_a at which they touch; k = `stiffness` [N/m]; e = `restitution` [-] at v_i = `impact_velocity`
    [m/s] of approach (see `elastic_end_stops`). Not for parts that are joined: use `spring_between`. Source: K. H.
    Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445, with the exponent 1.
    """

    clearance: Length = Field(default=0.0, description="x_b - x_a where the parts touch")
    stiffness: Stiffness = Field(default=1e8, gt=0, description="force per depth")
    restitution: Ratio = Field(default=0.5, ge=0, le=1, description="rebound over impact speed")
    impact_velocity: Velocity = Field(default=0.1, gt=0, description="impact speed at which the restitution holds")

    a = takes_motion("the part at lower x")
    b = takes_motion("the part at higher x")
    force = observable(Force, "force that pushes the parts apart")
    stored_energy = stores_energy("strain energy of the contact")
    loss = dissipates()

    def equations(self, x_a: Expr, x_b: Expr, v_a: Expr, v_b: Expr) -> Equations:
        depth, closing = maximum(x_a + self.clearance - x_b, 0.0), v_a - v_b
        force = contact_force(depth, closing, self.stiffness, self.restitution, self.impact_velocity)
        return {
            "f_a": force,
            "f_b": -force,
            "force": force,
            "stored_energy": self.stiffness * depth * depth / 2,
            "loss": (force - self.stiffness * depth) * closing,
        }


class ForceSource(Component):
    r"""Constant force on a mass.

    .. math:: f_{rod} = -F

    F = `force` [N] pushes the rod's mass towards increasing x; f_rod [N] is its reaction on the source. Not for
    forces that change with time (`signal_force_source`). Source: Newton's third law.
    """

    force: Force = Field(description="force on the mass, positive towards increasing x")

    rod = takes_motion("the pushed mass")
    supply = supplies()

    def equations(self) -> Equations:
        return {"f_rod": -self.force}


class SignalForceSource(Component):
    r"""Force on a mass, given by a signal.

    .. math:: f_{rod} = -F(t)

    F = `force` [N], a signal, pushes the rod's mass towards increasing x; f_rod [N] is its reaction on the
    source. Not for a drive that imposes the motion (`motion_source`). Source: Newton's third law.
    """

    force = takes_signal(Force, "force on the mass, positive towards increasing x")
    rod = takes_motion("the pushed mass")
    supply = supplies()

    def equations(self, force: Expr) -> Equations:
        return {"f_rod": -force}


class MotionSource(Component):
    r"""Motion at constant velocity, whatever the force: a belt, a slow drive, or the ground.

    .. math:: x = x_0 + V t, \quad v = V

    x [m]; v [m/s]; x_0 = `position` [m] at t = 0; V = `velocity` [m/s]; t [s]. Not for a drive that gives way
    under load. Source: definition of uniform motion.
    """

    velocity: Velocity = Field(default=0.0, description="constant velocity; 0 is the ground")
    position: Length = Field(default=0.0, description="position at t = 0")

    port = gives_motion("the driven end")
    supply = supplies()

    def equations(self, t: Expr) -> Equations:
        return {"x_port": self.position + self.velocity * t, "v_port": self.velocity}
