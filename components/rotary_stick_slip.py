"""Rotors with dry friction against the housing, which stick exactly: plain, and with a brake that a signal applies."""

from typing import Any, Self

from pydantic import BaseModel, Field, model_validator

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, gives_rotation, held, observable, state, stores_energy, takes_signal
from crescentlab.maths import Expr, maximum, minimum, not_, when, where
from crescentlab.units import Angle, Ratio, Speed, Torque


class _Rubbing(BaseModel):
    """A rotor and its friction."""

    inertia: units.Inertia = Field(gt=0, description="moment of inertia about the shaft")
    coulomb_friction: Torque = Field(ge=0, description="friction torque while turning")
    static_friction: Torque = Field(ge=0, description="largest friction torque at rest; at least coulomb_friction")

    @model_validator(mode="after")
    def _static_is_larger(self) -> Self:
        if self.static_friction < self.coulomb_friction:
            raise ValueError(
                f"static_friction ({self.static_friction:g} N m) must be at least coulomb_friction "
                f"({self.coulomb_friction:g} N m)"
            )
        return self

    def _law(self, phi: Any, omega: Any, direction: Any, torque: Any, share: Any) -> Equations:
        """Motion, friction, energies and events, with a share of the friction torques applied."""
        up, down, sticks = direction == 1, direction == -1, direction == 0
        slides, turning, most = up | down, share * self.coulomb_friction, share * self.static_friction
        friction = where(slides, -direction * turning, -minimum(maximum(torque, -most), most))
        onward = where(torque > most, 1.0, where(torque < -most, -1.0, 0.0))
        # where T_s = T_c, rounding could stop again at once what has just broken away
        stops = up & (omega < 0) & not_(torque > most) | down & (omega > 0) & not_(torque < -most)
        return {
            "phi_shaft": phi,
            "omega_shaft": omega,
            "der_phi": omega,
            "der_omega": where(slides, (torque - direction * turning) / self.inertia, 0.0),
            "sticking": where(slides, 0.0, 1.0),
            "friction": friction,
            "kinetic_energy": self.inertia * omega * omega / 2,
            "loss": -friction * omega,
            "stops": when(stops, omega=0.0, direction=onward),
            "breaks_away_up": when(sticks & (torque > most), direction=1.0),
            "breaks_away_down": when(sticks & (torque < -most), direction=-1.0),
            "starts": when(direction == 2, direction=where(omega > 0, 1.0, where(omega < 0, -1.0, 0.0))),
        }


class StickSlipInertia(_Rubbing, Component):
    r"""Rotor with dry friction against the housing, which sticks exactly and breaks away by events.

    .. math:: J \frac{d\omega}{dt} = \sum T - T_c\,\mathrm{sign}\,\omega \quad (\omega \ne 0), \qquad
              \omega = 0 \text{ while } \left|\sum T\right| \le T_s

    J = `inertia` [kg m^2]; \varphi [rad], never wrapped, \omega [rad/s]; T [N m] on the rotor; T_c =
    `coulomb_friction`, T_s = `static_friction` [N m]. When \omega crosses zero the rotor sticks, or turns on backwards
    if |T| > T_s at that instant; it breaks away when |T| > T_s. Its angle counts up, as that of `inertia`. Energy: J
    \omega^2/2 [J]; T_c |\omega| [W] is lost. Not for the Stribeck curve (`rotary_friction`, which creeps), nor for a
    brake that is applied and released (`friction_brake`). Source: Coulomb's law of friction; Karnopp, J. Dyn. Syst.
    Meas. Control 107 (1985) 100-103, with the zero-velocity band replaced by an event.
    """

    shaft = gives_rotation("the rotor")
    phi = state(Angle, "angle", start=0.0, nominal=1.0, counts=True)
    omega = state(Speed, "speed", start=0.0, nominal=1.0)
    direction = held(Ratio, "1 turns up, -1 turns down, 0 sticks; 2 until the start is looked at", start=2.0)
    sticking = observable(Ratio, "1 while the rotor sticks, 0 while it turns")
    friction = observable(Torque, "friction torque on the rotor")
    kinetic_energy = stores_energy("kinetic energy")
    loss = dissipates()

    def equations(self, phi: Expr, omega: Expr, direction: Expr, torque_shaft: Expr) -> Equations:
        return self._law(phi, omega, direction, torque_shaft, 1.0)


class FrictionBrake(_Rubbing, Component):
    r"""Rotor with a friction brake that a signal applies and releases; held exactly while the brake is strong enough.

    .. math:: J \frac{d\omega}{dt} = \sum T - a T_c\,\mathrm{sign}\,\omega \quad (\omega \ne 0), \qquad
              \omega = 0 \text{ while } \left|\sum T\right| \le a T_s

    J = `inertia` [kg m^2]; \varphi [rad], never wrapped, \omega [rad/s]; T [N m] on the rotor; a = `application` [-], a
    signal, 0 released, 1 fully applied, more where the pads are pressed harder; T_c =
    `coulomb_friction`, T_s = `static_friction` [N m] at a = 1. Sticking and breaking away are events, as in
    `stick_slip_inertia`. Its angle counts up, as that of `inertia`. Energy: J \omega^2/2 [J]; a T_c |\omega| [W] is
    lost. Not for a clutch between two rotors, nor for fading with heat. Source: Coulomb's law of friction; Karnopp, J.
    Dyn. Syst. Meas. Control 107 (1985) 100-103, with the zero-velocity band replaced by an event.
    """

    application = takes_signal(Ratio, "share of the full friction torque, 0 released", low=0)
    shaft = gives_rotation("the rotor")
    phi = state(Angle, "angle", start=0.0, nominal=1.0, counts=True)
    omega = state(Speed, "speed", start=0.0, nominal=1.0)
    direction = held(Ratio, "1 turns up, -1 turns down, 0 sticks; 2 until the start is looked at", start=2.0)
    sticking = observable(Ratio, "1 while the rotor is held, 0 while it turns")
    friction = observable(Torque, "friction torque on the rotor")
    kinetic_energy = stores_energy("kinetic energy")
    loss = dissipates()

    def equations(self, phi: Expr, omega: Expr, direction: Expr, torque_shaft: Expr, application: Expr) -> Equations:
        return self._law(phi, omega, direction, torque_shaft, application)
