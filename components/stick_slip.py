"""Masses with dry friction against the ground, which stick exactly: between rigid stops, or without any."""

from typing import Any, Self

from pydantic import BaseModel, Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, gives_motion, held, observable, state, stores_energy
from crescentlab.maths import Expr, fabs, maximum, minimum, not_, when, where
from crescentlab.units import Force, Length, Ratio, Velocity


class _Rubbing(BaseModel):
    """A mass and its friction."""

    mass: units.Mass = Field(gt=0, description="moving mass")
    coulomb_friction: Force = Field(ge=0, description="friction force while sliding")
    static_friction: Force = Field(ge=0, description="largest friction force while sticking; at least coulomb_friction")

    @model_validator(mode="after")
    def _static_is_larger(self) -> Self:
        if self.static_friction < self.coulomb_friction:
            raise ValueError(
                f"static_friction ({self.static_friction:g} N) must be at least coulomb_friction "
                f"({self.coulomb_friction:g} N)"
            )
        return self

    def _law(self, x: Any, v: Any, slides: Any, direction: Any, force: Any) -> Equations:
        """Motion, friction and energies while it slides or sticks."""
        sticking = minimum(maximum(force, -self.static_friction), self.static_friction)
        friction = where(slides, -direction * self.coulomb_friction, -sticking)
        return {
            "x_port": x,
            "v_port": v,
            "der_x": v,
            "der_v": where(slides, (force - direction * self.coulomb_friction) / self.mass, 0.0),
            "sticking": where(slides, 0.0, 1.0),
            "friction": friction,
            "kinetic_energy": self.mass * v * v / 2,
            "loss": -friction * v,
        }

    def _comes_to_rest(self, up: Any, down: Any, v: Any, force: Any) -> Any:
        """Whether v crosses zero against the way it slides; with F_s = F_c rounding alone would, as it breaks away."""
        F_s = self.static_friction
        return up & (v < 0) & not_(force > F_s) | down & (v > 0) & not_(force < -F_s)

    def _onward(self, force: Any) -> Any:
        """Where a mass that comes to rest slides on to: 1 up, -1 down, 0 it sticks."""
        return where(force > self.static_friction, 1.0, where(force < -self.static_friction, -1.0, 0.0))


class StickSlipMass(_Rubbing, Component):
    r"""Mass with dry friction against the ground, which sticks exactly and breaks away by events.

    .. math:: m \frac{dv}{dt} = \sum f - F_c\,\mathrm{sign}\,v \quad (v \ne 0), \qquad
              v = 0 \text{ while } \left|\sum f\right| \le F_s

    m = `mass` [kg]; x [m], v [m/s]; f [N] on the mass; F_c = `coulomb_friction`, F_s = `static_friction` [N]. When v
    crosses zero the mass sticks, or slides on backwards if |f| > F_s at that instant; it breaks away when |f| > F_s.
    Friction forces do not depend on speed while sliding. Not for stops (`stick_slip_mass_with_stops`), the Stribeck
    curve, nor friction between two moving parts (`friction_between`). Source: Coulomb's law of friction; Karnopp, J.
    Dyn. Syst. Meas. Control 107 (1985) 100-103, with the zero-velocity band replaced by an event.
    """

    port = gives_motion("the mass")
    x = state(Length, "position", start=0.0, nominal=1e-3)
    v = state(Velocity, "velocity", start=0.0, nominal=1e-2)
    direction = held(Ratio, "1 slides up, -1 slides down, 0 sticks; 2 until the start is looked at", start=2.0)
    sticking = observable(Ratio, "1 while the mass sticks, 0 while it slides")
    friction = observable(Force, "friction force on the mass")
    kinetic_energy = stores_energy("kinetic energy")
    loss = dissipates()

    def equations(self, x: Expr, v: Expr, direction: Expr, f_port: Expr) -> Equations:
        up, down, sticks = direction == 1, direction == -1, direction == 0
        return {
            **self._law(x, v, up | down, direction, f_port),
            "stops": when(self._comes_to_rest(up, down, v, f_port), v=0.0, direction=self._onward(f_port)),
            "breaks_away_up": when(sticks & (f_port > self.static_friction), direction=1.0),
            "breaks_away_down": when(sticks & (f_port < -self.static_friction), direction=-1.0),
            "starts": when(direction == 2, direction=where(v > 0, 1.0, where(v < 0, -1.0, 0.0))),
        }


class StickSlipMassWithStops(_Rubbing, Component):
    r"""Mass with dry friction between two rigid stops: a spool or piston that sticks, slides, rebounds and rests.

    .. math:: m \frac{dv}{dt} = \sum f - F_c\,\mathrm{sign}\,v \quad (v \ne 0), \qquad
              v = 0 \text{ while } \left|\sum f\right| \le F_s, \qquad v^+ = -e\,v^- \text{ at a stop}

    m = `mass` [kg]; x [m], v [m/s]; f [N] on the mass; F_c = `coulomb_friction`, F_s = `static_friction` [N]; e =
    `restitution` [-]; stops at `low` and `high` [m]. Between them as `stick_slip_mass`, at them as `mass_with_stops`: a
    rebound slower than `rest_speed` [m/s] ends at rest, and a resting mass leaves its stop once |f| > F_s points away
    from it. Energy: m v^2/2 [J]; F_c |v| [W] is lost, and (1 - e^2) m v^2/2 at an impact. Not for elastic stops
    (`elastic_end_stops`), nor for the Stribeck curve. Source: Coulomb's law of friction; law of impact; Karnopp, J.
    Dyn. Syst. Meas. Control 107 (1985) 100-103, with the zero-velocity band replaced by an event.
    """

    low: Length = Field(default=0.0, description="position of the low stop")
    high: Length = Field(description="position of the high stop")
    restitution: Ratio = Field(default=0.0, ge=0, le=1, description="rebound speed over impact speed")
    rest_speed: Velocity = Field(default=1e-3, gt=0, description="a rebound slower than this ends at rest")

    port = gives_motion("the mass")
    x = state(Length, "position", start="low", nominal=1e-3)
    v = state(Velocity, "velocity", start=0.0, nominal=1e-2)
    direction = held(Ratio, "1 slides up, -1 slides down, 0 sticks or rests; 2 until the start is looked at", start=2.0)
    at = held(Ratio, "-1 rests on the low stop, 1 on the high one, 0 neither", start=0.0)
    sticking = observable(Ratio, "1 while the mass sticks or rests, 0 while it slides")
    friction = observable(Force, "friction force on the mass")
    stop_force = observable(Force, "force of the stop on which the mass rests")
    kinetic_energy = stores_energy("kinetic energy")
    loss = dissipates()

    @model_validator(mode="after")
    def _stops_in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"high ({self.high * 1e3:g} mm) must lie above low ({self.low * 1e3:g} mm)")
        return self

    def equations(self, x: Expr, v: Expr, direction: Expr, at: Expr, f_port: Expr) -> Equations:
        up, down, sticks = direction == 1, direction == -1, direction == 0
        rebound = -self.restitution * v
        fast = fabs(rebound) > self.rest_speed
        law = self._law(x, v, up | down, direction, f_port)
        slow = fabs(v) <= self.rest_speed
        outside = where(slow & (x <= self.low), -1.0, where(slow & (x >= self.high), 1.0, 0.0))
        start = where(fabs(outside) > 0.5, 0.0, v)
        return {
            **law,
            "stop_force": where(sticks, -f_port - law["friction"], 0.0),
            "hits_low": when(
                down & (x < self.low), x=self.low, v=where(fast, rebound, 0.0), direction=where(fast, 1.0, 0.0),
                at=where(fast, 0.0, -1.0),
            ),
            "hits_high": when(
                up & (x > self.high), x=self.high, v=where(fast, rebound, 0.0), direction=where(fast, -1.0, 0.0),
                at=where(fast, 0.0, 1.0),
            ),
            "stops": when(self._comes_to_rest(up, down, v, f_port), v=0.0, direction=self._onward(f_port)),
            "breaks_away_up": when(sticks & not_(at == 1) & (f_port > self.static_friction), direction=1.0, at=0.0),
            "breaks_away_down": when(
                sticks & not_(at == -1) & (f_port < -self.static_friction), direction=-1.0, at=0.0
            ),
            "starts": when(
                direction == 2, x=minimum(maximum(x, self.low), self.high), v=start,
                direction=where(start > 0, 1.0, where(start < 0, -1.0, 0.0)), at=outside,
            ),
        }  # fmt: skip
