"""Sensors: turn a variable of a net into a signal without disturbing it."""

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    gives_pressure,
    gives_signal,
    reads_motion,
    reads_pressure,
    reads_rotation,
    takes_pressure,
)
from crescentlab.maths import Expr
from crescentlab.units import Angle, Flow, Length, Pressure, Speed, Velocity


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

    p [Pa]; q [m^3/s] positive into the sensor, so y is the flow from a to b. Port a belongs to the side whose
    pressure is given (a volume, a tank, a source), port b to a net without a giver of its own. It has no volume
    and no resistance. Not for a place between two volumes: they need a resistance between them, whose `q` is
    the flow. Source: ideal sensor.
    """

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
