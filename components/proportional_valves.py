"""Valves that a signal sets, and valves that share a flow out: by their static characteristics, with the lag of spools.

As in `pressure_valves`, nothing in them moves by itself: the spool follows, with a lag, where the pressures put it.
"""

from typing import Any

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, reads_pressure, state, takes_pressure, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fabs, sqrt
from crescentlab.units import Area, Flow, Pressure, Ratio

from .pressure_valves import Lagging
from .valve_laws import Metering, clipped


class ProportionalReliefValve(Lagging, Metering, Component):
    r"""Proportional relief valve: a signal sets its cracking pressure, as the current of a solenoid does.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{\Delta p - p_c}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_c = `setting` [Pa], from 0 on; p_r = `opening_range` [Pa]; s = `lift` [-]; A
    = `area` [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean
    pressure. At rest it passes q at \Delta p = p_c + s p_r, as a `relief_valve` of that setting. Current against
    pressure, the highest setting and the lag of the solenoid stand before it: `table`, `limiter`,
    `first_order_lag`. Not for flow forces, which `opening_range` may contain, nor for the valve's own oscillations.
    Source: balance of forces on a poppet between a solenoid and a linear spring; lag as in `relief_valve`.
    """

    opening_range: Pressure = Field(gt=0, description="drop beyond the setting until it is fully open")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    setting = takes_signal(Pressure, "drop at which the valve starts to open", low=0)
    lift = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, setting: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        target = (p_a - p_b - setting) / self.opening_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}


class FlowDivider(Lagging, Metering, Component):
    r"""Flow divider of spool type: shares its inlet out to two outlets in a set ratio, whatever their pressures.

    .. math:: q_k = C_d \frac{A_k n_k}{\sqrt{1 + n_k^2}} \sqrt{2 \rho |p - p_k|}/\rho_0\, \mathrm{sign}(p - p_k), \quad
              d_k = \frac{n_k^2}{1 + n_k^2} (p - p_k), \quad
              T \frac{dx}{dt} = \frac{d_a - d_b}{p_r} - x, \quad -1 \le x \le 1

    k = a, b; p [Pa] of the inlet, p_k of the outlets; A_a = \sigma A, A_b = (1 - \sigma) A [m^2] of the two fixed
    metering edges, A = `area`, \sigma = `share` [-]; behind each an edge of the spool of n_k A_k: n_a = e (1 - x), n_b
    = e (1 + x), e = `outlet_ratio` [-], x = `stroke` [-]; d_k [Pa] the drop over a metering edge, which is that share
    of the whole drop where both edges are turbulent; p_r = `centring_range` [Pa], the spool's springs over its face; T
    = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure. At rest
    q_a/q_b = \sigma/(1 - \sigma) \sqrt{d_a/d_b} with d_a - d_b = x p_r: exact at equal loads, off by x p_r/(4 d) of the
    flow of one side, for equal shares and d well above p_r, at others. An outlet that is blocked nearly stops the
    other: no more than C_d A_k \sqrt{2 p_r/\rho} passes there. Reversed flows are not shared: the larger one pushes the
    spool further its way until the other is shut, wherefore such valves have check valves beside them; with `combines`
    the spool is of two hooked parts and the ratio holds backwards too, by |d_a| - |d_b|, as long as both outlets flow
    the same way. Not for flow forces, laminar metering edges, nor for gear dividers (two `fixed_displacement_motor` on
    one shaft). Source: two edges in series, H. E. Merritt, Hydraulic Control Systems (1967), chapter 3, and balance of
    the pressures on the spool's ends; ISO 1219-1, flow divider.
    """

    area: Area = Field(gt=0, description="flow area of both metering edges together")
    share: Ratio = Field(default=0.5, gt=0, lt=1, description="share of the inlet's flow that goes to a")
    outlet_ratio: Ratio = Field(default=2.0, gt=0, description="outlet edge over metering edge, spool in the middle")
    centring_range: Pressure = Field(gt=0, description="difference of the metered drops at the end of the stroke")
    combines: bool = Field(default=False, description="whether it shares reversed flows, from a and b, too")

    inlet = takes_pressure("inlet")
    a = takes_pressure("first outlet")
    b = takes_pressure("second outlet")
    stroke = state(Ratio, "1 shuts the edge at a, -1 that at b", start=0.0, nominal=1.0)
    drop_a = observable(Pressure, "drop over the metering edge of a")
    drop_b = observable(Pressure, "drop over the metering edge of b")
    loss = dissipates()

    def equations(self, p_inlet: Expr, p_a: Expr, p_b: Expr, stroke: Expr, at: Expr, fluid: Fluid) -> Equations:
        x = clipped(stroke, -1.0)
        to_a, drop_a = self._side(p_inlet, p_a, self.share, 1 - x, fluid)
        to_b, drop_b = self._side(p_inlet, p_b, 1 - self.share, 1 + x, fluid)
        uneven = fabs(drop_a) - fabs(drop_b) if self.combines else drop_a - drop_b
        return {
            "q_inlet": to_a + to_b,
            "q_a": -to_a,
            "q_b": -to_b,
            "drop_a": drop_a,
            "drop_b": drop_b,
            **self.lag("stroke", stroke, at, uneven / self.centring_range, low=-1.0),
        }

    def _side(self, p: Any, p_out: Any, share: Any, opened: Any, fluid: Fluid) -> tuple[Any, Any]:
        """Flow [m^3/s] to an outlet through metering and outlet edge, and the drop [Pa] over the metering edge."""
        n = self.outlet_ratio * opened
        q = self.through(p, p_out, share * self.area * n / sqrt(1 + n * n), fluid)
        return q, (p - p_out) * n * n / (1 + n * n)


class PriorityValve(Lagging, Metering, Component):
    r"""Priority valve: feeds its priority outlet first, what that does not need goes to the other one.

    .. math:: q_{CF} = C_d (1 - s) A \sqrt{2\rho|p - p_{CF}|}/\rho_0, \quad
              q_{EF} = C_d\, s A \sqrt{2\rho|p - p_{EF}|}/\rho_0,
              \quad T \frac{ds}{dt} = \frac{p_{CF} - p_{LS} - p_c}{p_r} - s, \quad 0 \le s \le 1

    p [Pa] of the inlet, p_CF of the priority outlet, p_EF of the surplus, p_LS at the load, flows of the sign of their
    drops; p_c = `control_pressure`, p_r = `control_range` [Pa]; s = `lift` [-]; A = `area` [m^2] of each fully open
    edge; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure.
    An orifice behind the priority outlet, and `load` behind that, makes the priority flow: the drop over it is held
    between p_c and p_c + p_r, whichever outlet has the higher pressure, as long as the inlet has enough. A steering
    unit there is load sensing; a fixed orifice takes a constant flow. The load port takes no fluid. Without pressure
    all is open to the priority outlet. Not for flow forces, leakage, nor dynamic load sensing lines.
    Source: balance of forces on a spool with a linear spring; ISO 1219-1, priority flow divider.
    """

    control_pressure: Pressure = Field(gt=0, description="priority outlet over load from which surplus is let out")
    control_range: Pressure = Field(gt=0, description="further pressure until the priority outlet is shut")

    inlet = takes_pressure("inlet, from the pump")
    priority = takes_pressure("priority outlet CF, to the orifice")
    surplus = takes_pressure("outlet EF of what is left over")
    load = reads_pressure("load LS, behind the orifice")
    lift = state(Ratio, "0 all open to the priority outlet, 1 to the surplus", start=0.0, nominal=1.0)
    loss = dissipates()

    def equations(
        self, p_inlet: Expr, p_priority: Expr, p_surplus: Expr, p_load: Expr, lift: Expr, at: Expr, fluid: Fluid
    ) -> Equations:
        target = (p_priority - p_load - self.control_pressure) / self.control_range
        first = self.metered(p_inlet, p_priority, 1 - lift, fluid)
        rest = self.metered(p_inlet, p_surplus, lift, fluid)
        return {"q_inlet": first + rest, "q_priority": -first, "q_surplus": -rest, **self.lag("lift", lift, at, target)}
