"""Sensors: turn a variable of a net into a signal without disturbing it."""

from typing import ClassVar

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    gives_motion,
    gives_pressure,
    gives_rotation,
    gives_signal,
    reads_motion,
    reads_pressure,
    reads_rotation,
    takes_motion,
    takes_pressure,
    takes_rotation,
)
from crescentlab.maths import Expr
from crescentlab.units import Angle, Flow, Force, Length, Pressure, Speed, Torque, Velocity


class PressureSensor(Component):
    r"""Pressure of a net as a signal.

    .. math:: y = p

    p [Pa] gauge. Not for a transducer's own dynamics. Source: ideal sensor.
    """

    port = reads_pressure("where the pressure is read")
    y = gives_signal(Pressure, "the pressure")

    def equations(self, p_port: Expr) -> Equations:
        return {"y": p_port}


class DifferentialPressureSensor(Component):
    r"""Difference of two pressures as a signal.

    .. math:: y = p_a - p_b

    p [Pa]. Not for a transducer's own dynamics. Source: ideal sensor.
    """

    a = reads_pressure("positive side")
    b = reads_pressure("negative side")
    y = gives_signal(Pressure, "pressure at a less pressure at b")

    def equations(self, p_a: Expr, p_b: Expr) -> Equations:
        return {"y": p_a - p_b}


class FlowSensor(Component):
    r"""Flow through a line as a signal; put in series between a volume and what draws from it.

    .. math:: p_b = p_a, \quad y = q_a = -q_b

    p [Pa]; q [m^3/s] positive into the sensor, mass flow over \rho_0, so y is the flow from a to b as volume at 0 bar
    gauge. Port a belongs to the side whose pressure is given (a volume, a tank, a source), port b to a net without a
    giver of its own. It has no volume and no resistance. Not for a place between two volumes: they need a resistance
    between them, whose `q` is the flow. Source: ideal sensor.
    """

    lossless: ClassVar[bool] = True

    a = takes_pressure("side of the volume")
    b = gives_pressure("side that draws from it")
    y = gives_signal(Flow, "flow from a to b")

    def equations(self, p_a: Expr, q_b: Expr) -> Equations:
        return {"p_b": p_a, "q_a": -q_b, "y": -q_b}


class SpeedSensor(Component):
    r"""Speed of a shaft as a signal.

    .. math:: y = \omega

    \omega [rad/s]. Not for a tachometer's own dynamics. Source: ideal sensor.
    """

    shaft = reads_rotation("where the speed is read")
    y = gives_signal(Speed, "the speed")

    def equations(self, omega_shaft: Expr) -> Equations:
        return {"y": omega_shaft}


class AngleSensor(Component):
    r"""Angle of a shaft as a signal, not wrapped at a full turn.

    .. math:: y = \varphi

    \varphi [rad]. Not for encoders that count within one turn. Source: ideal sensor.
    """

    shaft = reads_rotation("where the angle is read")
    y = gives_signal(Angle, "the angle")

    def equations(self, phi_shaft: Expr) -> Equations:
        return {"y": phi_shaft}


class PositionSensor(Component):
    r"""Position of a moving part as a signal.

    .. math:: y = x

    x [m]. Not for a transducer's own dynamics. Source: ideal sensor.
    """

    port = reads_motion("where the position is read")
    y = gives_signal(Length, "the position")

    def equations(self, x_port: Expr) -> Equations:
        return {"y": x_port}


class VelocitySensor(Component):
    r"""Velocity of a moving part as a signal.

    .. math:: y = v

    v [m/s]. Not for a transducer's own dynamics. Source: ideal sensor.
    """

    port = reads_motion("where the velocity is read")
    y = gives_signal(Velocity, "the velocity")

    def equations(self, v_port: Expr) -> Equations:
        return {"y": v_port}


class ForceSensor(Component):
    r"""Force between two moving parts as a signal; put in series between a mass and what acts on it.

    .. math:: x_b = x_a, \quad v_b = v_a, \quad y = f_a = -f_b

    x [m]; v [m/s]; f [N] on the sensor, so y is the force with which what is at a pushes what is at b towards
    increasing x. Port a belongs to the side whose motion is given (a mass, a drive), port b to a net without a giver of
    its own. It has neither mass nor compliance. Not for a place between two masses: they need a spring between them,
    whose tension is the force. Source: ideal sensor; Newton's third law.
    """

    lossless: ClassVar[bool] = True

    a = takes_motion("side of the mass")
    b = gives_motion("side of what acts on it")
    y = gives_signal(Force, "force from a on b")

    def equations(self, x_a: Expr, v_a: Expr, f_b: Expr) -> Equations:
        return {"x_b": x_a, "v_b": v_a, "f_a": -f_b, "y": -f_b}


class TorqueSensor(Component):
    r"""Torque in a shaft as a signal; put in series between a drive or inertia and what loads it.

    .. math:: \varphi_b = \varphi_a, \quad \omega_b = \omega_a, \quad y = T_a = -T_b

    \varphi [rad]; \omega [rad/s]; T [N m] on the sensor, so y is the torque with which what is at a drives what is at
    b. Port a belongs to the side whose rotation is given (a drive, an inertia), port b to a net without a giver of its
    own. It has neither inertia nor compliance. Not for a place between two inertias: they need a shaft between them.
    Source: ideal sensor; Newton's third law.
    """

    lossless: ClassVar[bool] = True

    a = takes_rotation("side of the drive")
    b = gives_rotation("side of the load")
    y = gives_signal(Torque, "torque from a on b")

    def equations(self, phi_a: Expr, omega_a: Expr, torque_b: Expr) -> Equations:
        return {"phi_b": phi_a, "omega_b": omega_a, "torque_a": -torque_b, "y": -torque_b}
