"""Rotational mechanics: inertias, elastic shafts, gear ratios, torques, friction. Imposed speeds are in `rotation`."""

from typing import ClassVar, Literal

from pydantic import Field

from crescentlab import units
from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_rotation,
    observable,
    state,
    stores_energy,
    supplies,
    takes_rotation,
    takes_signal,
)
from crescentlab.maths import Expr, exp, fabs, tanh
from crescentlab.units import Angle, Ratio, RotaryDamping, RotaryStiffness, Speed, Torque


class Inertia(Component):
    r"""Rotor that turns for ever, driven by the torques on it.

    .. math:: J \frac{d\omega}{dt} = \sum T, \quad \frac{d\varphi}{dt} = \omega

    J = `inertia` [kg m^2]; \varphi [rad], never wrapped; \omega [rad/s]; T [N m] on the rotor. Its angle counts up: a
    steady or periodic run does not wait for it. Not for a rotor that comes to rest at an angle because something
    depends on that angle (`swivelling_inertia`). Source: Euler's law of rotation about a fixed axis.
    """

    inertia: units.Inertia = Field(gt=0, description="moment of inertia about the shaft")

    shaft = gives_rotation("the rotor")
    phi = state(Angle, "angle", start=0.0, nominal=1.0, counts=True)
    omega = state(Speed, "speed", start=0.0, nominal=1.0)
    kinetic_energy = stores_energy("kinetic energy")

    def equations(self, phi: Expr, omega: Expr, torque_shaft: Expr) -> Equations:
        return {
            "phi_shaft": phi,
            "omega_shaft": omega,
            "der_phi": omega,
            "der_omega": torque_shaft / self.inertia,
            "kinetic_energy": self.inertia * omega * omega / 2,
        }


class SwivellingInertia(Component):
    r"""Rotor that swings about an angle: a swash plate's cradle, a pendulum, a rotary drive that is positioned.

    .. math:: J \frac{d\omega}{dt} = \sum T, \quad \frac{d\varphi}{dt} = \omega

    J = `inertia` [kg m^2]; \varphi [rad]; \omega [rad/s]; T [N m] on the rotor. As `inertia`, but a steady run solves
    for its angle as well. Not for a rotor that turns on and on: it never comes to rest.
    Source: Euler's law of rotation about a fixed axis.
    """

    inertia: units.Inertia = Field(gt=0, description="moment of inertia about the shaft")

    shaft = gives_rotation("the rotor")
    phi = state(Angle, "angle", start=0.0, nominal=1e-2)
    omega = state(Speed, "speed", start=0.0, nominal=1.0)
    kinetic_energy = stores_energy("kinetic energy")

    def equations(self, phi: Expr, omega: Expr, torque_shaft: Expr) -> Equations:
        return {
            "phi_shaft": phi,
            "omega_shaft": omega,
            "der_phi": omega,
            "der_omega": torque_shaft / self.inertia,
            "kinetic_energy": self.inertia * omega * omega / 2,
        }


class TorsionSpring(Component):
    r"""Torsion spring against the housing.

    .. math:: T = T_0 + c \varphi

    T [N m] on the rotor, towards -\varphi; T_0 = `preload` [N m] at \varphi = 0; c = `stiffness` [N m/rad]; \varphi
    [rad]. Belongs on a `swivelling_inertia`. Not between two rotors (`elastic_shaft`). Source: Hooke's law.
    """

    stiffness: RotaryStiffness = Field(gt=0, description="torque per angle")
    preload: Torque = Field(default=0.0, description="torque at angle 0")

    shaft = takes_rotation("the sprung rotor")
    stored_energy = stores_energy("strain energy, 0 at angle 0")

    def equations(self, phi_shaft: Expr) -> Equations:
        return {
            "torque_shaft": self.preload + self.stiffness * phi_shaft,
            "stored_energy": (self.preload + self.stiffness * phi_shaft / 2) * phi_shaft,
        }


class ElasticShaft(Component):
    r"""Shaft that twists between two rotors, with the damping of its material.

    .. math:: \frac{d\vartheta}{dt} = \omega_a - \omega_b, \quad T = c \vartheta + d (\omega_a - \omega_b)

    \vartheta [rad] twist, a state of its own, so that the rotors' angles may be counted on for ever; \omega [rad/s];
    T [N m] torque that a gives to b; c = `stiffness` [N m/rad]; d = `damping` [N m s/rad]. For a round bar
    c = G \pi d^4/(32 l). Not for play (`backlash`). Source: Hooke's law in torsion with Kelvin-Voigt damping; J. P. Den
    Hartog, Mechanical Vibrations (1956), torsional vibration.
    """

    stiffness: RotaryStiffness = Field(gt=0, description="torque per twist")
    damping: RotaryDamping = Field(default=0.0, ge=0, description="torque per speed of twist")

    a = takes_rotation("driving end")
    b = takes_rotation("driven end")
    twist = state(Angle, "angle of a less angle of b, from the torque-free state", start=0.0, nominal=1e-3)
    torque = observable(Torque, "torque from a to b")
    stored_energy = stores_energy("strain energy")
    loss = dissipates()

    def equations(self, twist: Expr, omega_a: Expr, omega_b: Expr) -> Equations:
        slip = omega_a - omega_b
        torque = self.stiffness * twist + self.damping * slip
        return {
            "torque_a": torque,
            "torque_b": -torque,
            "der_twist": slip,
            "torque": torque,
            "stored_energy": self.stiffness * twist * twist / 2,
            "loss": self.damping * slip * slip,
        }


class GearRatio(Component):
    r"""Pair of gears, a belt or a planetary stage: a fixed ratio of speeds without loss, inertia or play.

    .. math:: \varphi_b = \pm \varphi_a / i, \quad \omega_b = \pm \omega_a / i, \quad T_a \pm T_b / i = 0

    \varphi [rad]; \omega [rad/s]; T [N m] on the gears; i = `ratio` [-], speed of a over speed of b; - where the
    shafts turn against each other (`sense` opposite). No power is lost. Shaft a belongs to an inertia or a source; b
    gives its rotation to what it drives: a second inertia goes behind an `elastic_shaft`, or is reflected to a as
    J/i^2. Not for losses of gears: put a `rotary_friction` on a shaft. Source: rolling of pitch circles.
    """

    lossless: ClassVar[bool] = True

    ratio: Ratio = Field(gt=0, description="speed of a over speed of b")
    sense: Literal["same", "opposite"] = Field(default="same", description="sense of rotation of b against a")

    a = takes_rotation("shaft of the inertia or the source")
    b = gives_rotation("shaft that is driven")

    def equations(self, phi_a: Expr, omega_a: Expr, torque_b: Expr) -> Equations:
        gain = (1.0 if self.sense == "same" else -1.0) / self.ratio
        return {"phi_b": gain * phi_a, "omega_b": gain * omega_a, "torque_a": -gain * torque_b}


class RotaryDamper(Component):
    r"""Viscous friction of a rotor against the housing.

    .. math:: T = d \omega

    T [N m] on the rotor, against its speed \omega [rad/s]; d = `coefficient` [N m s/rad]. Not for dry friction
    (`rotary_friction`). Source: definition of viscous damping.
    """

    coefficient: RotaryDamping = Field(ge=0, description="torque per speed")

    shaft = takes_rotation("the rotor")
    loss = dissipates()

    def equations(self, omega_shaft: Expr) -> Equations:
        return {"torque_shaft": self.coefficient * omega_shaft}


class RotaryFriction(Component):
    r"""Dry and viscous friction of a rotor against the housing, with the Stribeck curve; creeps instead of sticking.

    .. math:: T = \left[T_c + (T_s - T_c) e^{-(\omega/\omega_s)^2}\right] \tanh\frac{\omega}{\omega_t} + d \omega

    T [N m] on the rotor, against its speed \omega [rad/s]; T_c = `coulomb_friction`, T_s = `static_friction` [N m];
    \omega_s = `stribeck_speed`, \omega_t = `creep_speed` [rad/s], below which the friction falls to zero with the
    speed; d = `viscous_friction` [N m s/rad]. Not for a rotor held still under load: it creeps at up to \omega_t.
    Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083-1138; rounded at
    rest by a hyperbolic tangent.
    """

    coulomb_friction: Torque = Field(ge=0, description="friction torque while turning")
    static_friction: Torque = Field(ge=0, description="friction torque at the start of turning")
    stribeck_speed: Speed = Field(default=1.0, gt=0, description="decay of static to Coulomb friction")
    creep_speed: Speed = Field(default=0.1, gt=0, description="width of the rounding at rest")
    viscous_friction: RotaryDamping = Field(default=0.0, ge=0, description="torque per speed")

    shaft = takes_rotation("the rotor")
    loss = dissipates()

    def equations(self, omega_shaft: Expr) -> Equations:
        share = omega_shaft / self.stribeck_speed
        dry = self.coulomb_friction + (self.static_friction - self.coulomb_friction) * exp(-share * share)
        torque = dry * tanh(omega_shaft / self.creep_speed) + self.viscous_friction * omega_shaft
        return {"torque_shaft": torque, "loss": torque * omega_shaft}


class TorqueSource(Component):
    r"""Constant torque on a rotor.

    .. math:: T_{shaft} = -T

    T = `torque` [N m] turns the rotor towards increasing angle; T_shaft [N m] is its reaction on the source. Not for
    torques that change with time (`signal_torque_source`). Source: Newton's third law.
    """

    torque: Torque = Field(description="torque on the rotor, positive towards increasing angle")

    shaft = takes_rotation("the driven rotor")
    power = supplies("power given to the rotor")

    def equations(self, omega_shaft: Expr) -> Equations:
        return {"torque_shaft": -self.torque, "power": self.torque * omega_shaft}


class SignalTorqueSource(Component):
    r"""Torque on a rotor, given by a signal.

    .. math:: T_{shaft} = -T(t)

    T = `torque` [N m], a signal, turns the rotor towards increasing angle; T_shaft [N m] is its reaction on the
    source. Not for a drive that imposes the speed (`signal_speed_source`). Source: Newton's third law.
    """

    torque = takes_signal(Torque, "torque on the rotor, positive towards increasing angle")
    shaft = takes_rotation("the driven rotor")
    power = supplies("power given to the rotor")

    def equations(self, torque: Expr, omega_shaft: Expr) -> Equations:
        return {"torque_shaft": -torque, "power": torque * omega_shaft}


class FanLoad(Component):
    r"""Load whose torque grows with the square of the speed: a fan, a propeller, a water brake.

    .. math:: T = T_r \frac{\omega |\omega|}{\omega_r^2}

    T [N m] on the rotor, against its speed \omega [rad/s]; T_r = `rated_torque` [N m] at \omega_r = `rated_speed`
    [rad/s]. Not for a load with breakaway torque. Source: affinity laws of turbomachines.
    """

    rated_torque: Torque = Field(ge=0, description="torque at the rated speed")
    rated_speed: Speed = Field(gt=0, description="speed of the rating")

    shaft = takes_rotation("the driving rotor")
    power = dissipates("power taken from the rotor")

    def equations(self, omega_shaft: Expr) -> Equations:
        share = omega_shaft / self.rated_speed
        torque = self.rated_torque * share * fabs(share)
        return {"torque_shaft": torque, "power": torque * omega_shaft}
