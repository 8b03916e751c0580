"""Sources of rotation: shafts turned at a speed that no torque can change. Inertias and loads are not here."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    gives_rotation,
    observable,
    state,
    supplies,
    takes_signal,
)
from crescentlab.maths import Expr
from crescentlab.units import Angle, Speed, Torque


class SpeedSource(Component):
    r"""Shaft turned at a constant speed whatever the torque.

    .. math:: \frac{d\varphi}{dt} = \omega, \quad M = -T, \quad P = M\omega

    \varphi [rad], never wrapped; \omega = `speed` [rad/s]; T [N m] sum of the torques on the source; M [N m]
    torque and P [W] power that the source gives to the shaft. Not for motors that give way under load.
    Source: boundary condition.
    """

    speed: Speed = Field(description="speed of the shaft")
    start_angle: Angle = Field(default=0.0, description="angle at the start")

    shaft = gives_rotation("the driven shaft")
    phi = state(Angle, "angle of the shaft", start="start_angle", nominal=1.0, counts=True)
    torque = observable(Torque, "torque the source gives to the shaft")
    power = supplies("power the source gives to the shaft")

    def equations(self, phi: Expr, torque_shaft: Expr) -> Equations:
        return {
            "phi_shaft": phi,
            "omega_shaft": self.speed,
            "der_phi": self.speed,
            "torque": -torque_shaft,
            "power": -torque_shaft * self.speed,
        }


class SignalSpeedSource(Component):
    r"""Shaft turned at the speed a signal asks for, whatever the torque.

    .. math:: \frac{d\varphi}{dt} = u, \quad M = -T, \quad P = M u

    \varphi [rad], never wrapped; u = signal `speed` [rad/s]; T [N m] sum of the torques on the source; M [N m]
    torque and P [W] power that the source gives to the shaft. Not for motors that give way under load.
    Source: boundary condition.
    """

    start_angle: Angle = Field(default=0.0, description="angle at the start")

    shaft = gives_rotation("the driven shaft")
    speed = takes_signal(Speed, "speed of the shaft")
    phi = state(Angle, "angle of the shaft", start="start_angle", nominal=1.0, counts=True)
    torque = observable(Torque, "torque the source gives to the shaft")
    power = supplies("power the source gives to the shaft")

    def equations(self, phi: Expr, speed: Expr, torque_shaft: Expr) -> Equations:
        return {
            "phi_shaft": phi,
            "omega_shaft": speed,
            "der_phi": speed,
            "torque": -torque_shaft,
            "power": -torque_shaft * speed,
        }
