"""Ends of a hydraulic circuit: tanks, vents, sources of pressure and flow, and plugs. They store nothing."""

from typing import ClassVar

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, observable, state, supplies, takes_pressure, takes_signal
from crescentlab.maths import Expr
from crescentlab.units import Flow, Pressure, Volume


class Tank(Component):
    r"""Reservoir of constant pressure that takes and gives any flow.

    .. math:: p = p_T

    p_T = `pressure` [Pa] gauge. Not for a level that changes (`reservoir`). Source: boundary condition; p_T of Rundo &
    Corvaglia (2016), list of symbols.
    """

    pressure: Pressure = Field(default=0.0, description="pressure above the atmosphere")

    port = gives_pressure("the reservoir")
    supply = supplies()

    def equations(self) -> Equations:
        return {"p_port": self.pressure}


class AtmosphericVent(Component):
    r"""Opening to the atmosphere: what reaches it leaves the circuit, and is counted.

    .. math:: p = 0, \quad \frac{dV}{dt} = q_{port}

    p [Pa] gauge; q [m^3/s] into the vent; V = `lost` [m^3] volume at 0 bar gauge that has left, less what was drawn in
    again. The fluid that a circuit draws through it is the circuit's own: not for the air that a real vent would let
    in. Source: boundary condition.
    """

    port = gives_pressure("the atmosphere")
    lost = state(Volume, "volume that has left", start=0.0, nominal=1e-6, counts=True)
    outflow = observable(Flow, "flow into the atmosphere")
    supply = supplies()

    def equations(self, q_port: Expr) -> Equations:
        return {"p_port": 0.0, "der_lost": q_port, "outflow": q_port}


class PressureSource(Component):
    r"""Source that holds a constant pressure whatever the flow.

    .. math:: p = p_s

    p_s = `pressure` [Pa] gauge. Not for supplies of limited flow. Source: boundary condition.
    """

    pressure: Pressure = Field(description="pressure held")

    port = gives_pressure("the source")
    supply = supplies()

    def equations(self) -> Equations:
        return {"p_port": self.pressure}


class SignalPressureSource(Component):
    r"""Source that holds the pressure a signal asks for, whatever the flow.

    .. math:: p = u

    u = signal `pressure` [Pa] gauge. Not for supplies of limited flow. Source: boundary condition.
    """

    port = gives_pressure("the source")
    pressure = takes_signal(Pressure, "pressure held")
    supply = supplies()

    def equations(self, pressure: Expr) -> Equations:
        return {"p_port": pressure}


class FlowSource(Component):
    r"""Source of a constant flow whatever the pressure.

    .. math:: q_{port} = -Q

    Q = `flow` [m^3/s], positive out of the source into the circuit: mass flow over the density at 0 bar gauge.
    q [m^3/s] is positive into the source. Not for pumps with leakage or ripple. Source: boundary condition.
    """

    flow: Flow = Field(description="flow out of the source")

    port = takes_pressure("the outlet")
    supply = supplies()

    def equations(self) -> Equations:
        return {"q_port": -self.flow}


class SignalFlowSource(Component):
    r"""Source of the flow a signal asks for, whatever the pressure.

    .. math:: q_{port} = -u

    u = signal `flow` [m^3/s], positive out of the source into the circuit: mass flow over the density at 0 bar
    gauge. q [m^3/s] is positive into the source. Not for pumps with leakage. Source: boundary condition.
    """

    port = takes_pressure("the outlet")
    flow = takes_signal(Flow, "flow out of the source")
    supply = supplies()

    def equations(self, flow: Expr) -> Equations:
        return {"q_port": -flow}


class Plug(Component):
    r"""Closed end.

    .. math:: q = 0

    q [m^3/s]. Not needed where a net has other ports that take its pressure. Source: boundary condition.
    """

    lossless: ClassVar[bool] = True

    port = takes_pressure("what is closed")

    def equations(self) -> Equations:
        return {"q_port": 0.0}
