"""Pressure valves by their static characteristics, with the lag of their poppets: no moving parts of their own.

Each opens in proportion to what the pressures exceed its setting by, as a spring's stiffness makes it, and follows them
with a lag. What the pressures ask for may lie beyond the stops, so that a poppet is thrown onto its seat the faster the
more its spring outweighs them; there it rests until they lead it away. Valves built of spool, spring and faces are
circuits: `relief_valve_part.yaml` and its like.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from crescentlab.component import Component, Equations
from crescentlab.domain import Held, dissipates, held, observable, reads_pressure, state, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, maximum, pi
from crescentlab.units import Flow, Frequency, Pressure, Ratio, Time

from .valve_laws import Metering, follower, lagging


class Lagging(BaseModel):
    """First-order lag of a valve's moving part behind the position that the forces on it ask for."""

    model_config = ConfigDict(ignored_types=(Held,))

    time_constant: Time = Field(
        default=5e-3, gt=0, description="lag of the moving part behind the pressures: its damping over its stiffness"
    )

    at = held(Ratio, "-1 rests on the low stop, 1 on the high one, 0 free; -2 until the start is looked at", start=-2.0)

    def lag(self, name: str, position: Any, at: Any, target: Any, low: Any = 0.0) -> dict[str, Any]:
        """Derivative and events of the state `name`, led to its `target` [-] between `low` and 1."""
        return lagging(name, position, at, target, self.time_constant, low)


class ReliefValve(Lagging, Metering, Component):
    r"""Relief valve: static characteristic with a first-order lag.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{\Delta p - p_c}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_c = `cracking_pressure`, p_r = `opening_range` [Pa]; s = `lift` [-]; A = `area` [m^2];
    T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure.
    At rest it passes q at \Delta p = p_c + s p_r. The poppet rests on its seat, and on its stop at s = 1, until the
    pressure leads it away. Not for the valve's own oscillations (`second_order_relief_valve`, whose limit of much
    damping this is, T = 2 \zeta/\omega), nor for flow forces, which `opening_range` may contain.
    Source: balance of forces on a poppet with a linear spring; lag after Rundo & Corvaglia (2016), section 4, without
    mass: T is damping over stiffness.
    """

    cracking_pressure: Pressure = Field(gt=0, description="drop at which the valve starts to open")
    opening_range: Pressure = Field(gt=0, description="further drop until it is fully open")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    lift = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        target = (p_a - p_b - self.cracking_pressure) / self.opening_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}


class SecondOrderReliefValve(Metering, Component):
    r"""Relief valve: static characteristic with the second-order motion of its poppet.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              \frac{d^2 s}{dt^2} + 2 \zeta \omega \frac{ds}{dt} + \omega^2 s = \omega^2 \frac{\Delta p - p_c}{p_r},
              \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_c = `cracking_pressure`, p_r = `opening_range` [Pa]; s = `position` [-]; A = `area`
    [m^2]; \omega = 2 \pi f [rad/s], f = `natural_frequency` [Hz] of poppet and spring; \zeta = `damping_ratio` [-];
    C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure. The poppet rests on its seat,
    and on its stop at s = 1, until the pressure leads it away; what it hits does not throw it back. Not for the fluid
    that the poppet displaces, nor for flow forces, which `opening_range` may contain.
    Source: Newton's second law for a poppet on a linear spring; Rundo & Corvaglia (2016), section 4.
    """

    cracking_pressure: Pressure = Field(gt=0, description="drop at which the valve starts to open")
    opening_range: Pressure = Field(gt=0, description="further drop until it is fully open")
    natural_frequency: Frequency = Field(gt=0, description="undamped natural frequency of poppet and spring")
    damping_ratio: Ratio = Field(default=0.7, ge=0, description="damping over critical damping")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet")
    position = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    rate = state(Frequency, "openings per time", start=0.0, nominal=100.0)
    at = held(Ratio, "-1 rests on the seat, 1 on the stop, 0 free", start=0.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, position: Expr, rate: Expr, at: Expr, fluid: Fluid) -> Equations:
        target = (p_a - p_b - self.cracking_pressure) / self.opening_range
        omega = 2 * pi * self.natural_frequency
        q = self.metered(p_a, p_b, position, fluid)
        moves = follower(position, rate, at, target, omega, self.damping_ratio, low=0.0)
        return {"q_a": q, "q_b": -q, "q": q, **moves}


class ReducingValve(Lagging, Metering, Component):
    r"""Two-way pressure reducing valve: closes as its outlet reaches the set pressure.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{p_c - (p_b - p_d)}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_b [Pa] the reduced pressure, p_d [Pa] that of the drain behind the spring; p_c =
    `set_pressure` at which it is closed, p_r = `closing_range` below which it is fully open [Pa]; s = `lift` [-];
    A = `area` [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the
    mean pressure. It starts open. Not for an outlet that is driven above the set pressure (`reducing_relieving_valve`),
    nor for flow forces. Source: balance of forces on a spool with a linear spring; ISO 1219-1, pressure-reducing valve.
    """

    set_pressure: Pressure = Field(gt=0, description="reduced pressure at which the valve is closed")
    closing_range: Pressure = Field(gt=0, description="how far below that it is fully open")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet, under the reduced pressure")
    drain = reads_pressure("drain of the spring chamber")
    lift = state(Ratio, "share of the full opening", start=1.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_drain: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        target = (self.set_pressure - (p_b - p_drain)) / self.closing_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}


class ReducingRelievingValve(Lagging, Metering, Component):
    r"""Three-way pressure reducing valve: feeds its outlet below the set pressure, relieves it to the tank above.

    .. math:: q_{in} = C_d \max(s, 0) A \sqrt{2\rho|p_s - p_o|}/\rho_0, \quad
              q_{out} = C_d \max(-s - u, 0) A \sqrt{2\rho|p_o - p_t|}/\rho_0, \quad
              T \frac{ds}{dt} = \frac{p_c - (p_o - p_t)}{p_r} - s, \quad -1 - u \le s \le 1

    p_s, p_o, p_t [Pa] of supply, outlet and tank, flows of the sign of their drops; p_c = `set_pressure` up to which it
    feeds, p_r = `closing_range` [Pa] from shut to fully open on either side; s = `stroke` [-] of the spool in travels
    from shut to fully open; u = p_u/p_r [-], p_u = `dead_band` [Pa], its overlap: it relieves from p_c + p_u on; A =
    `area` [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean
    pressure. The spool rests on either stop until the pressure leads it away. Not for flow forces.
    Source: balance of forces on a spool with a linear spring; ISO 1219-1, three-way reducing valve.
    """

    set_pressure: Pressure = Field(gt=0, description="outlet pressure up to which the valve feeds")
    closing_range: Pressure = Field(gt=0, description="how far from there it is fully open")
    dead_band: Pressure = Field(default=0.0, ge=0, description="further pressure from which it relieves")

    supply = takes_pressure("inlet")
    outlet = takes_pressure("outlet, under the reduced pressure")
    tank = takes_pressure("where the outlet is relieved to, and the spring chamber drains")
    stroke = state(Ratio, "1 fully open to the supply, 0 shut, below -dead_band/closing_range open to the tank",
                   start=0.0, nominal=1.0)  # fmt: skip
    q_in = observable(Flow, "flow from the supply to the outlet")
    q_out = observable(Flow, "flow from the outlet to the tank")
    loss = dissipates()

    def equations(
        self, p_supply: Expr, p_outlet: Expr, p_tank: Expr, stroke: Expr, at: Expr, fluid: Fluid
    ) -> Equations:
        overlap = self.dead_band / self.closing_range
        missing = self.set_pressure - (p_outlet - p_tank)
        into = self.metered(p_supply, p_outlet, maximum(stroke, 0.0), fluid)
        out = self.metered(p_outlet, p_tank, maximum(-stroke - overlap, 0.0), fluid)
        return {
            "q_supply": into,
            "q_outlet": out - into,
            "q_tank": -out,
            "q_in": into,
            "q_out": out,
            **self.lag("stroke", stroke, at, missing / self.closing_range, low=-1 - overlap),
        }


class SequenceValve(Lagging, Metering, Component):
    r"""Sequence valve: passes fluid on once its inlet, or a pilot line, has reached the set pressure.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{p_x - p_d - p_c}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_x [Pa] of the pilot, which is joined to the inlet's net (internal pilot) or to another
    line (external); p_d [Pa] of the drain behind the spring, so that the outlet's pressure does not matter; p_c =
    `set_pressure` from which it opens, p_r = `opening_range` [Pa]; s = `lift` [-]; A = `area` [m^2]; T =
    `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure. Pilot and
    drain take no fluid. Flow back needs a `check_valve` beside it. Not for a spring chamber that is drained to the
    outlet (`relief_valve`), flow forces, nor leakage. Piloted from a pump's other line it unloads that pump.
    Source: balance of forces on a spool with a linear spring; ISO 1219-1, sequence valve with external drain.
    """

    set_pressure: Pressure = Field(gt=0, description="pilot's pressure over the drain's at which it starts to open")
    opening_range: Pressure = Field(gt=0, description="further pressure until it is fully open")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet, to what comes next")
    pilot = reads_pressure("what opens it: the inlet's net, or another line")
    drain = reads_pressure("drain of the spring chamber")
    lift = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(
        self, p_a: Expr, p_b: Expr, p_pilot: Expr, p_drain: Expr, lift: Expr, at: Expr, fluid: Fluid
    ) -> Equations:
        target = (p_pilot - p_drain - self.set_pressure) / self.opening_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}


class CounterbalanceValve(Lagging, Metering, Component):
    r"""Counterbalance valve: holds a load until its own pressure and that of the pilot open it.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{p_a + R p_x - (1 + R) p_b - p_c}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_a [Pa] of the load, p_b of the outlet, whose pressure acts on the spring's side: a
    vented valve has p_a + R p_x - p_c instead; p_x [Pa] of the pilot; R = `pilot_ratio` [-]; p_c = `set_pressure`, p_r
    = `opening_range` [Pa]; s = `lift` [-]; A = `area` [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number
    as in `orifice`; \rho [kg/m^3] at the mean pressure. For p_b = 0 it opens from p_x = (p_c - p_a)/R on. The pilot
    port takes no fluid. Lifting the load needs a `check_valve` beside it: `counterbalance_valve_part.yaml`. Not for
    flow forces, nor leakage.
    Source: balance of forces on poppet and pilot; ISO 1219-1, counterbalance valve with pilot assistance.
    """

    set_pressure: Pressure = Field(gt=0, description="load pressure at which it opens without pilot; above the load's")
    opening_range: Pressure = Field(gt=0, description="further pressure until it is fully open")
    pilot_ratio: Ratio = Field(default=3.0, ge=0, description="pilot area over relief area")
    vented: bool = Field(default=False, description="whether the spring's side is vented to the atmosphere")

    a = takes_pressure("load")
    b = takes_pressure("outlet, towards the directional valve")
    pilot = reads_pressure("pilot port X: the other side of the load")
    lift = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_pilot: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        back = 0.0 if self.vented else (1 + self.pilot_ratio) * p_b
        target = (p_a + self.pilot_ratio * p_pilot - back - self.set_pressure) / self.opening_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}


class PressureCompensator(Lagging, Metering, Component):
    r"""Pressure compensator: keeps the drop over a metering edge behind it constant, whatever the load.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{p_c + p_r - (p_b - p_l)}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_b - p_l [Pa] the drop over the metering edge between the outlet b and the load l; p_c =
    `control_pressure` at which it begins to close, p_r = `closing_range` [Pa] until it is closed; s = `lift` [-];
    A = `area` [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the
    mean pressure. It starts open. The load port takes no fluid. Not for sending a surplus to the tank
    (`bypass_compensator`), nor for flow forces.
    Source: H. E. Merritt, Hydraulic Control Systems (1967), chapter 5; balance of forces on a spool with a spring.
    """

    control_pressure: Pressure = Field(gt=0, description="drop over the metering edge at which it begins to close")
    closing_range: Pressure = Field(gt=0, description="further drop until it is closed")

    a = takes_pressure("inlet")
    b = takes_pressure("outlet, before the metering edge")
    load = reads_pressure("behind the metering edge")
    lift = state(Ratio, "share of the full opening", start=1.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_load: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        excess = p_b - p_load - self.control_pressure
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, 1 - excess / self.closing_range)}


class BypassCompensator(Lagging, Metering, Component):
    r"""Bypass compensator: keeps the drop over a metering edge constant by sending the surplus to the tank.

    .. math:: q = C_d\, s A \sqrt{2\rho|\Delta p|}/\rho_0\, \mathrm{sign}\,\Delta p, \quad
              T \frac{ds}{dt} = \frac{p_a - p_l - p_c}{p_r} - s, \quad 0 \le s \le 1

    \Delta p = p_a - p_b [Pa]; p_a - p_l [Pa] the drop over the metering edge between the inlet a, at the pump, and the
    load l; p_c = `control_pressure` at which it begins to open, p_r = `opening_range` [Pa]; s = `lift` [-]; A = `area`
    [m^2]; T = `time_constant` [s]; C_d [-] follows the flow number as in `orifice`; \rho [kg/m^3] at the mean pressure.
    With an `orifice` from a to l it is the three-way flow control, with a proportional valve the load-sensing inlet of
    a constant pump, which then works p_c to p_c + p_r above the load. The load port takes no fluid. Not for several
    such valves on one pump, a limit of the load's pressure (a `relief_valve` beside it), nor for flow forces.
    Source: balance of forces on a spool with a linear spring; ISO 1219-1, three-way flow control valve.
    """

    control_pressure: Pressure = Field(gt=0, description="drop over the metering edge at which it begins to open")
    opening_range: Pressure = Field(gt=0, description="further drop until it is fully open")

    a = takes_pressure("inlet, before the metering edge")
    b = takes_pressure("bypass, to the tank")
    load = reads_pressure("behind the metering edge")
    lift = state(Ratio, "share of the full opening", start=0.0, nominal=1.0)
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, p_load: Expr, lift: Expr, at: Expr, fluid: Fluid) -> Equations:
        target = (p_a - p_load - self.control_pressure) / self.opening_range
        q = self.metered(p_a, p_b, lift, fluid)
        return {"q_a": q, "q_b": -q, "q": q, **self.lag("lift", lift, at, target)}
