"""Meters: power passing through a line, a rod, a shaft, and what adds up to volume and energy."""

from typing import ClassVar

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    gives_motion,
    gives_pressure,
    gives_rotation,
    gives_signal,
    state,
    takes_motion,
    takes_pressure,
    takes_rotation,
    takes_signal,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr
from crescentlab.units import Energy, Power, Volume


class HydraulicPowerMeter(Component):
    r"""Hydraulic power through a line as a signal; put in series as a `flow_sensor`.

    .. math:: y = p\, Q, \quad Q = \frac{\rho_0}{\rho(p)} q_a, \quad p_b = p_a, \quad q_a = -q_b

    p [Pa] gauge; Q [m^3/s] volume flow at the pressure p, q [m^3/s] mass flow over \rho_0; y [W] from a to b. Port a
    belongs to the side whose pressure is given, port b to a net without a giver of its own. Not for the energy stored
    in the fluid's compression. Source: definition of hydraulic power, ISO 4391.
    """

    lossless: ClassVar[bool] = True

    a = takes_pressure("side of the volume")
    b = gives_pressure("side that draws from it")
    y = gives_signal(Power, "power from a to b")

    def equations(self, p_a: Expr, q_b: Expr, fluid: Fluid) -> Equations:
        return {"p_b": p_a, "q_a": -q_b, "y": -p_a * q_b * fluid.rho_0 / fluid.density(p_a)}


class LinearPowerMeter(Component):
    r"""Mechanical power through a rod as a signal; put in series as a `force_sensor`.

    .. math:: y = f_a v_a, \quad x_b = x_a, \quad v_b = v_a, \quad f_a = -f_b

    x [m]; v [m/s]; f [N] on the meter; y [W] from a to b. Port a belongs to the side whose motion is given (a mass),
    port b to a net without a giver of its own. Not for a place between two masses. Source: definition of power.
    """

    lossless: ClassVar[bool] = True

    a = takes_motion("side of the mass")
    b = gives_motion("side of what acts on it")
    y = gives_signal(Power, "power from a to b")

    def equations(self, x_a: Expr, v_a: Expr, f_b: Expr) -> Equations:
        return {"x_b": x_a, "v_b": v_a, "f_a": -f_b, "y": -f_b * v_a}


class ShaftPowerMeter(Component):
    r"""Mechanical power through a shaft as a signal; put in series as a `torque_sensor`.

    .. math:: y = T_a \omega_a, \quad \varphi_b = \varphi_a, \quad \omega_b = \omega_a, \quad T_a = -T_b

    \varphi [rad]; \omega [rad/s]; T [N m] on the meter; y [W] from a to b. Port a belongs to the side whose rotation is
    given (a drive, an inertia), port b to a net without a giver of its own. Not for a place between two inertias.
    Source: definition of power.
    """

    lossless: ClassVar[bool] = True

    a = takes_rotation("side of the drive")
    b = gives_rotation("side of the load")
    y = gives_signal(Power, "power from a to b")

    def equations(self, phi_a: Expr, omega_a: Expr, torque_b: Expr) -> Equations:
        return {"phi_b": phi_a, "omega_b": omega_a, "torque_a": -torque_b, "y": -torque_b * omega_a}


class EnergyCounter(Component):
    r"""Energy: what a signal of power adds up to.

    .. math:: \frac{dE}{dt} = P

    E = `y` [J], 0 at the start; P = signal `power` [W]. It counts backwards while the power flows back. A mean power
    is a difference of E over the time between. Not for the energy of one part: give it a power meter. Source:
    definition.
    """

    power = takes_signal(Power, "power")
    y = gives_signal(Energy, "energy since the start")
    energy = state(Energy, "energy since the start", start=0.0, nominal=1.0, counts=True)

    def equations(self, energy: Expr, power: Expr) -> Equations:
        return {"y": energy, "der_energy": power}


class VolumeCounter(Component):
    r"""Volume that has passed through a line; put in series as a `flow_sensor`.

    .. math:: \frac{dV}{dt} = q_a, \quad p_b = p_a, \quad q_a = -q_b

    V = `y` [m^3], 0 at the start, as volume at 0 bar gauge (mass over \rho_0); p [Pa]; q [m^3/s], so V counts from a
    to b and backwards while the flow turns round. Port a belongs to the side whose pressure is given, port b to a net
    without a giver of its own. Not for the volume at the pressure of the line. Source: definition.
    """

    lossless: ClassVar[bool] = True

    a = takes_pressure("side of the volume")
    b = gives_pressure("side that draws from it")
    y = gives_signal(Volume, "volume passed since the start")
    volume = state(Volume, "volume passed since the start", start=0.0, nominal=1e-6, counts=True)

    def equations(self, p_a: Expr, q_b: Expr, volume: Expr) -> Equations:
        return {"p_b": p_a, "q_a": -q_b, "y": volume, "der_volume": -q_b}
