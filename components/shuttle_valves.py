"""Shuttle valves: they join a common port to the higher of two pressures."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, held, observable, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, when, where
from crescentlab.units import Flow, Pressure, Ratio

from .valve_laws import Metering


class ShuttleValve(Metering, Component):
    r"""Shuttle valve: the higher of two pressures reaches the common port, the other is shut off by the ball.

    .. math:: q = C_d A \sqrt{2\rho|p_k - p_o|}/\rho_0\, \mathrm{sign}(p_k - p_o), \quad
              k = a \to b \text{ as } p_b - p_a > p_w, \quad k = b \to a \text{ as } p_a - p_b > p_w

    p_a, p_b, p_o [Pa] of the two inlets and the outlet; p_w = `switching_pressure` [Pa], within which the ball stays
    where it is; A = `area` [m^2]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure,
    \rho_0 at 0 bar gauge. The ball moves at once, by an event; it starts on the seat of b. Not for the flow from inlet
    to inlet while the ball moves, nor for leakage. Source: ISO 1219-1, shuttle valve; Rundo & Corvaglia (2016), Eqs.
    27-29 for the flow.
    """

    switching_pressure: Pressure = Field(default=0.1e5, gt=0, description="difference that moves the ball")

    a = takes_pressure("first inlet")
    b = takes_pressure("second inlet")
    outlet = takes_pressure("common port")
    at = held(Ratio, "1 joins a and the outlet, -1 joins b and the outlet", start=1.0)
    q = observable(Flow, "flow to the outlet")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_outlet: Expr, at: Expr, fluid: Fluid) -> Equations:
        q_a = self.metered(p_a, p_outlet, where(at == 1, 1.0, 0.0), fluid)
        q_b = self.metered(p_b, p_outlet, where(at == 1, 0.0, 1.0), fluid)
        return {
            "q_a": q_a,
            "q_b": q_b,
            "q_outlet": -q_a - q_b,
            "q": q_a + q_b,
            "to_b": when(p_b - p_a > self.switching_pressure, at=-1.0),
            "to_a": when(p_a - p_b > self.switching_pressure, at=1.0),
        }
