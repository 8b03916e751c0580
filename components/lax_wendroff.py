"""The distributed line solved by the Lax-Wendroff scheme: a family of four causal forms."""

from functools import reduce
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from crescentlab.component import Component, Equations, structural
from crescentlab.domain import gives_pressure, held, observable, state, stores, takes_pressure, undecided_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, every, fabs, fail_when, maximum, minimum, pi, stack, total
from crescentlab.units import Flow, Length, Pressure, Ratio, Time, Volume

from .flow_laws import pipe_friction_drop
from .two_ports import line_series, line_shunt, two_port_of
from .wave_laws import (
    Between,
    Wave,
    arriving_wave,
    closing_flux,
    end_flow,
    end_pressure,
    full_step,
    half_step,
    wave_speed,
)

CELL_LENGTH_OVER_DIAMETER = 6
"""Length over diameter [-] of the cells, where `internal_nodes` is not given."""
BELOW = 1e-9
"""Share of the atmosphere by which rounding may put a node below absolute zero."""

LOSS_STEPS = 3
"""Steps to the density ahead of an entry loss, each to a share of loss over bulk modulus: numerics."""


def _start_pressures(line: "LaxWendroffLine", fluid: Fluid | None = None) -> np.ndarray:
    if fluid is None:
        return np.full(line.nodes, line.start_pressure)
    loss: Any = line.entry_loss(line.start_pressure, fluid) * line.start_flow * abs(line.start_flow)
    gradient = line.friction(fluid)(line.start_flow, line.start_pressure - loss)
    return np.asarray(line.start_pressure - loss - gradient * np.linspace(0.0, line.length, line.nodes))


class LaxWendroffLine(Component):
    r"""Straight rigid line with travelling waves, by the two-step Lax-Wendroff scheme.

    .. math:: A \frac{\partial r}{\partial t} + \frac{\partial q}{\partial x} = 0, \qquad
              \frac{\rho_0}{A}\frac{\partial q}{\partial t} + \frac{\partial p}{\partial x}
              = -\frac{f}{d}\frac{\rho v|v|}{2}, \qquad r = \rho(p)/\rho_0, \; v = q/(A r)

    p [Pa] gauge; q [m^3/s] mass flow over \rho_0, positive from a to b; A = \pi d^2/4 [m^2]; d [m]; x [m]; t [s];
    v [m/s]; \rho [kg/m^3], \rho_0 at 0 bar gauge; f [-] Darcy factor of steady flow (Churchill). All are taken from
    the fluid at every node and half node. The nodes, \Delta x [m] apart, step every
    \Delta t = \nu \Delta x/a(p_{max}) [s], \nu = `courant_number` [-], a [m/s] the wave speed. Between two ticks an
    end sees the wave that arrives there, p - Z q along dx/dt = -a (at b mirrored), Z = \rho_0 a/A [Pa s/m^3], from
    the foot of its characteristic; what the end then has becomes its node's value at the tick, so that neither jumps.
    The entry loss K \rho(p_a) v|v|/2 [Pa] sits at end a. The fluid in the nodes, half cells at the ends, changes by
    what the ends take in, exactly. Valid while (a + |v|) \Delta t/\Delta x, the observable `courant`, is below 1.
    It keeps no books of energy: of what passes an end between two ticks only the fluid is summed up, and what the
    scheme takes from steep waves at a tick is no friction.
    Not for friction that depends on frequency, for flow near the speed of sound (the convective term, v/a, is left
    out), for lines of less than some ten diameters, nor for cavities: a node below absolute zero ends the run.
    Source: R. D. Richtmyer, NCAR Technical Note 63-2 (1962); Wylie & Streeter, Fluid Transients in Systems (1993),
    chapter 3; used for the test rig's pipe in Rundo & Corvaglia (2016), section 6.1.
    """

    family: ClassVar[bool] = True
    sampling: ClassVar[str] = "courant_number"

    diameter: Length = structural(gt=0, description="inner diameter")
    length: Length = structural(gt=0, description="length")
    internal_nodes: int | None = Field(
        default=None, ge=1, description="nodes between the ends; default from cells six diameters long, at least 1"
    )
    loss_coefficient: Ratio = Field(default=0.0, ge=0, description="entry loss at a over the dynamic head")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness")
    max_pressure: Pressure = Field(gt=0, description="highest pressure expected; sets the tick by its wave speed")
    courant_number: Ratio = Field(default=0.9, gt=0, le=1, description="Courant number at max_pressure")
    start_pressure: Pressure = Field(default=0.0, description="pressure at a at the start, lower towards b by friction")
    start_flow: Flow = Field(default=0.0, description="flow from a to b at the start")

    a = undecided_pressure("first end")
    b = undecided_pressure("second end")
    p_node = held(Pressure, "pressure of each node, from a to b", start=_start_pressures, size="nodes")
    q_node = held(Flow, "flow from a to b of each node", start="start_flow", size="nodes")
    t_node = held(Time, "time of the nodes' values", counts=True)
    into_a = state(Volume, "fluid taken in at a since the start", nominal=1e-8, counts=True)
    into_b = state(Volume, "fluid taken in at b since the start", nominal=1e-8, counts=True)
    had_a = held(Volume, "into_a at the last tick", counts=True)
    had_b = held(Volume, "into_b at the last tick", counts=True)
    q = observable(Flow, "flow from a to b, at a")
    courant = observable(Ratio, "largest Courant number of the nodes; above 1 the scheme is not valid")
    p_highest = observable(Pressure, "highest pressure of the nodes; max_pressure must not be below it")
    p_lowest = observable(Pressure, "lowest pressure of the nodes; below absolute zero the run ends")
    content = stores()

    @property
    def cells(self) -> int:
        """Number of cells, one less than nodes."""
        if self.internal_nodes is not None:
            return self.internal_nodes + 1
        return max(2, round(self.length / (CELL_LENGTH_OVER_DIAMETER * self.diameter)))

    @property
    def nodes(self) -> int:
        """Number of nodes, both ends included."""
        return self.cells + 1

    @property
    def area(self) -> float:
        """Area of the bore [m^2]."""
        return pi * self.diameter * self.diameter / 4

    @property
    def cell(self) -> float:
        """Distance of neighbouring nodes [m]."""
        return self.length / self.cells

    def two_port(self, omega: Any, p_mean: float, q_mean: float, fluid: Fluid) -> Any:
        """Flows into the line per end pressures [m^3/(s Pa)] at omega [rad/s], shape (m, 2, 2): the exact waves.

        The entry loss is linearised, 2 k |q|; symbols and Source: :mod:`.two_ports`.
        """
        series = line_series(omega, self.diameter, self.roughness, fluid, p_mean, q_mean)
        shunt = line_shunt(omega, self.diameter, fluid, p_mean)
        return two_port_of(series, shunt, self.length, 2 * float(self.entry_loss(p_mean, fluid)) * abs(q_mean))

    def entry_loss(self, p: Any, fluid: Fluid) -> Any:
        """k of the entry loss k q|q| [Pa s^2/m^6], which is K rho v|v|/2 at p [Pa]."""
        return self.loss_coefficient * fluid.rho_0 * fluid.rho_0 / (2 * fluid.density(p) * self.area * self.area)

    def friction(self, fluid: Fluid) -> Any:
        """Pressure gradient of steady friction [Pa/m] as a function of q and p."""
        return lambda q, p: pipe_friction_drop(q, 1.0, self.diameter, self.roughness, fluid, p)

    def waves(self, p: Expr, q: Expr, elapsed: Expr, fluid: Fluid) -> tuple[Wave, Wave]:
        """The waves arriving at a and at b, `elapsed` [s] after the nodes' values p and q were taken."""
        friction = self.friction(fluid)
        to_a = arriving_wave((p[0], p[1]), (q[0], q[1]), elapsed, self.cell, friction, fluid)
        to_b = arriving_wave((p[-1], p[-2]), (-q[-1], -q[-2]), elapsed, self.cell, friction, fluid)
        return to_a, to_b

    def flow_at_a(self, p: Expr, wave: Wave, fluid: Fluid) -> Any:
        """q_a from the pressure taken there."""
        return end_flow(p, wave, self.entry_loss(p, fluid), self.area, fluid)

    def flow_at_b(self, p: Expr, wave: Wave, fluid: Fluid) -> Any:
        """q_b from the pressure taken there."""
        return end_flow(p, wave, 0.0, self.area, fluid)

    def pressure_at_a(self, q: Expr, wave: Wave, fluid: Fluid) -> Any:
        """p_a from the flow received there."""
        behind = before = end_pressure(q, wave, 0.0, self.area, fluid)
        for _ in range(LOSS_STEPS):
            before = behind + self.entry_loss(before, fluid) * q * fabs(q)
        return before

    def pressure_at_b(self, q: Expr, wave: Wave, fluid: Fluid) -> Any:
        """p_b from the flow received there."""
        return end_pressure(q, wave, 0.0, self.area, fluid)

    def nodes_and_tick(
        self, p_node: Expr, q_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr, had_b: Expr,
        p_a: Expr, q_a: Expr, p_b: Expr, q_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        """What all forms share: the fluid taken in, what the nodes hold, and how they step."""
        area, dx = self.area, self.cell
        dt = self.courant_number * dx / wave_speed(self.max_pressure, fluid)
        taken_a, taken_b = into_a - had_a, into_b - had_b
        p_first, q_first = p_a - self.entry_loss(p_a, fluid) * q_a * fabs(q_a), q_a
        p_last, q_last = p_b, -q_b

        half = half_step(p_node, q_node, dt, dx, area, self.friction(fluid), fluid)
        to_a, to_b = self.waves(p_node, q_node, dt / 2, fluid)
        q_in, p_in = closing_flux(
            p_node[0], q_node[0], p_first, q_first, taken_a, to_a, half.g[0], dt, dx, area, fluid
        )  # fmt: skip
        q_out, p_out = closing_flux(
            p_node[-1], -q_node[-1], p_last, -q_last, taken_b, to_b, -half.g[-1], dt, dx, area, fluid
        )  # fmt: skip
        between = Between(stack(q_in, half.q[1:-1], -q_out), stack(p_in, half.p[1:-1], p_out), half.g)
        p_inner, q_inner = full_step(p_node, q_node, between, dt, dx, area, fluid)

        r = fluid.density(p_node) / fluid.rho_0
        courant = reduce(maximum, wave_speed(p_node, fluid) + fabs(q_node) / (area * r)) * dt / dx
        shared: Equations = {} if fluid.tension else {
            "below_zero": fail_when(
                reduce(minimum, p_node) < -fluid.atmospheric_pressure * (1 + BELOW),
                "its pressure falls to {p_lowest} gauge at a node, below absolute zero; the oil would cavitate, and "
                "this line shows no cavities: take a distributed_line in a fluid that evaporates, or a "
                "transmission_line, which opens a cavity at its ends, or write tension: true in the fluid to go on",
            )
        }  # fmt: skip
        return shared | {
            "der_into_a": q_a,
            "der_into_b": q_b,
            "q": q_a,
            "courant": courant,
            "too_fast": fail_when(
                courant > 1,
                "its Courant number exceeds 1, so the waves outrun the time step; "
                "write a max_pressure above the highest pressure that comes, at least {p_highest}",
            ),
            "p_highest": reduce(maximum, p_node),
            "p_lowest": reduce(minimum, p_node),
            "content": area * dx * (total(r) - (r[0] + r[-1]) / 2) + taken_a + taken_b,
            "tick": every(
                dt,
                p_node=stack(p_first, p_inner, p_last),
                q_node=stack(q_first, q_inner, q_last),
                t_node=t,
                had_a=into_a,
                had_b=into_b,
            ),
        }


class LaxWendroffLineTakesTakes(LaxWendroffLine):
    """Lax-Wendroff line that takes the pressure at both ends.

    Equations, symbols, limits and Source: :class:`LaxWendroffLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = takes_pressure("second end")

    def equations(
        self, p_node: Expr, q_node: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr, had_b: Expr,
        p_a: Expr, p_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_a, to_b = self.waves(p_node, q_node, t - t_node, fluid)
        q_a, q_b = self.flow_at_a(p_a, to_a, fluid), self.flow_at_b(p_b, to_b, fluid)
        shared = self.nodes_and_tick(
            p_node, q_node, into_a, into_b, had_a, had_b, p_a, q_a, p_b, q_b, t, fluid
        )  # fmt: skip
        return {"q_a": q_a, "q_b": q_b} | shared


class LaxWendroffLineTakesGives(LaxWendroffLine):
    """Lax-Wendroff line that takes the pressure at a and gives it at b.

    Equations, symbols, limits and Source: :class:`LaxWendroffLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = gives_pressure("second end")

    def equations(
        self, p_node: Expr, q_node: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr, had_b: Expr,
        p_a: Expr, q_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_a, to_b = self.waves(p_node, q_node, t - t_node, fluid)
        q_a, p_b = self.flow_at_a(p_a, to_a, fluid), self.pressure_at_b(q_b, to_b, fluid)
        shared = self.nodes_and_tick(
            p_node, q_node, into_a, into_b, had_a, had_b, p_a, q_a, p_b, q_b, t, fluid
        )  # fmt: skip
        return {"q_a": q_a, "p_b": p_b} | shared


class LaxWendroffLineGivesTakes(LaxWendroffLine):
    """Lax-Wendroff line that gives the pressure at a and takes it at b.

    Equations, symbols, limits and Source: :class:`LaxWendroffLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = takes_pressure("second end")

    def equations(
        self, p_node: Expr, q_node: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr, had_b: Expr,
        q_a: Expr, p_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_a, to_b = self.waves(p_node, q_node, t - t_node, fluid)
        p_a, q_b = self.pressure_at_a(q_a, to_a, fluid), self.flow_at_b(p_b, to_b, fluid)
        shared = self.nodes_and_tick(
            p_node, q_node, into_a, into_b, had_a, had_b, p_a, q_a, p_b, q_b, t, fluid
        )  # fmt: skip
        return {"p_a": p_a, "q_b": q_b} | shared


class LaxWendroffLineGivesGives(LaxWendroffLine):
    """Lax-Wendroff line that gives the pressure at both ends.

    Equations, symbols, limits and Source: :class:`LaxWendroffLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = gives_pressure("second end")

    def equations(
        self, p_node: Expr, q_node: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr, had_b: Expr,
        q_a: Expr, q_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_a, to_b = self.waves(p_node, q_node, t - t_node, fluid)
        p_a, p_b = self.pressure_at_a(q_a, to_a, fluid), self.pressure_at_b(q_b, to_b, fluid)
        shared = self.nodes_and_tick(
            p_node, q_node, into_a, into_b, had_a, had_b, p_a, q_a, p_b, q_b, t, fluid
        )  # fmt: skip
        return {"p_a": p_a, "p_b": p_b} | shared
