"""Lines of many lumps inside the ODE: pressures and flows on a staggered grid."""

from functools import reduce
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_pressure,
    observable,
    state,
    stores,
    stores_energy,
    takes_pressure,
    undecided_pressure,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fabs, maximum, pi, stack, total
from crescentlab.units import Flow, Frequency, Length, Pressure, Ratio

from .flow_laws import pipe_friction_drop
from .frequency_friction import (
    MOST_TERMS,
    added_gradient,
    added_inertia,
    lag_loss,
    lagging_rates,
    moving,
    terms_of,
)
from .line_energy import heat, kinetic_energy
from .line_walls import LineWall
from .two_ports import line_series, two_port_of

ONE_PERCENT = 0.06**0.5
r"""Half the phase of a wave over one cell [rad] at which it is 1 % slow: \sin(x)/x = 1 - x^2/6."""


def _start_pressures(line: "DistributedLine", fluid: Fluid | None = None) -> np.ndarray:
    gradient: Any = 0.0
    if fluid is not None:
        q, p = line.start_flow, line.start_pressure
        drop: Any = pipe_friction_drop(q, line.length, line.diameter, line.roughness, fluid, p, line.loss_coefficient)
        gradient = drop / line.length
    first = 0.0 if line.gives("a") else 0.5
    return np.asarray(line.start_pressure - gradient * line.cell * (first + np.arange(line.pressures)))


class DistributedLine(LineWall, Component):
    r"""Straight line of N cells inside the ODE, with steady or frequency-dependent friction, of any causality.

    .. math:: \frac{\rho_0 \Delta x}{A} \frac{dq_i}{dt} = p_{i-1} - p_i - R(q_i) - \Delta x\, g_u, \qquad
              A \Delta x \frac{\rho}{\rho_0} \left(\frac{1 + C p_i}{\beta} + C\right) \frac{dp_i}{dt} = q_i - q_{i+1}

    p [Pa] gauge; q [m^3/s] mass flow over \rho_0, positive from a to b; A = \pi d^2/4 [m^2], d = `diameter` [m]; R [Pa]
    losses of steady flow, all regimes (Churchill), and `loss_coefficient` spread over the length; g_u [Pa/m] what
    laminar friction adds when flow changes, by `friction_terms` terms of Kagawa's fit, 0 for none; C [1/Pa]
    compliance of an elastic wall, d/(e E) [2 e (1 + \mu)/d + c d/(d + e)], 0 if rigid, e = `wall_thickness` [m],
    E = `youngs_modulus` [Pa], \mu = `poisson_ratio` [-], c [-] = 1 between expansion joints, 1 - \mu^2 anchored
    throughout, 1 - \mu/2 upstream; \rho [kg/m^3] and \beta [Pa] at every node.
    An end that meets a volume takes its pressure: a flow of half a cell's inertia sits
    there. An end that meets an orifice gives the pressure: half a cell's volume sits there. \Delta x [m] is
    `length`/N between like ends, `length`/(N + 1/2) between unlike ones. Waves of frequency f [Hz] are slow by
    (\pi f \Delta x/a)^2/6: 10 cells put the first mode of a line with one closed end, a/(4 l), 0.1 % low (full cells
    at the ends, 4.9 %) and the second, three times as high, 0.8 %; `highest_frequency` says where it is 1 %. Sharp
    fronts ring; for those use `transmission_line` or `lax_wendroff_line`. Not for unsteady friction of turbulent flow,
    nor flow near the speed of sound (the convective term, v/a, is left out).
    Energy: e(p) of the fluid, C p^2/2 of the wall and \tfrac12 \rho v^2 of the motion per volume, in the lagging flows
    what its profile has more than a flat one [J]; lost is friction times volume flow [W], booked together with
    what the convective term would balance, v/a of the motion's power and of either sign.
    Source: staggered grid as the IRC lumps of Rundo & Corvaglia (2016), section 5;
    Zielke (1968), Kagawa et al. (1983); Wylie & Streeter, Fluid Transients in Systems (1993), section 3-4.
    """

    family: ClassVar[bool] = True

    length: Length = Field(gt=0, description="length")
    diameter: Length = Field(gt=0, description="inner diameter")
    cells: int = Field(default=10, ge=1, description="N; highest_frequency says what it is good for")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness; 0 is smooth")
    loss_coefficient: Ratio = Field(default=0.0, ge=0, description="entry, exit and bends, on the dynamic head")
    friction_terms: int = Field(
        default=0, ge=0, le=MOST_TERMS, description="terms of the frequency-dependent laminar friction; 0 is steady"
    )
    start_pressure: Pressure = Field(default=0.0, description="pressure at a at the start, lower towards b by friction")
    start_flow: Flow = Field(default=0.0, description="flow from a to b at the start")

    a = undecided_pressure("first end")
    b = undecided_pressure("second end")
    p_node = state(Pressure, "pressures, from a to b", start=_start_pressures, nominal=1e5, size="pressures")
    q_node = state(Flow, "flows from a to b, in order", start="start_flow", nominal=1e-3 / 60, size="flows")
    q_lag = state(
        Flow, "flows lagging behind q_node, term by term", start="start_flow", nominal=1e-3 / 60, size="lagging"
    )
    q = observable(Flow, "flow from a to b, at a")
    reynolds_number = observable(Ratio, "largest Reynolds number; above some 2300 the flow is not laminar")
    highest_frequency = observable(Frequency, "frequency up to which waves are no more than 1 % slow")
    content = stores()
    stored_energy = stores_energy()
    loss = dissipates()

    @classmethod
    def gives(cls, end: str) -> bool:
        """Whether an end gives its pressure."""
        return cls.port_named(end).role == "gives"

    @property
    def pressures(self) -> int:
        """Number of pressures inside and at giving ends."""
        return self.cells + (self.gives("a") or self.gives("b"))

    @property
    def flows(self) -> int:
        """Number of flows inside and at taking ends."""
        return self.cells + (not (self.gives("a") and self.gives("b")))

    @property
    def lagging(self) -> int:
        """Number of lagging flows."""
        return self.friction_terms * self.flows

    @property
    def cell(self) -> Any:
        r"""\Delta x [m]."""
        return self.length / (self.cells + (0.5 if self.gives("a") != self.gives("b") else 0.0))

    def two_port(self, omega: Any, p_mean: float, q_mean: float, fluid: Fluid) -> Any:
        """Flows into the line per end pressures [m^3/(s Pa)] at omega [rad/s], shape (m, 2, 2): the exact waves.

        The losses are linearised and spread over the length; symbols and Source: :mod:`.two_ports`.
        """
        spread = self.loss_coefficient / self.length
        series = line_series(omega, self.diameter, self.roughness, fluid, p_mean, q_mean, spread)
        return two_port_of(series, self.shunt(omega, p_mean, self.diameter, fluid), self.length)

    @property
    def lumps(self) -> int:
        """Lumps that the line is cut into: its cells."""
        return self.cells

    @property
    def places(self) -> np.ndarray:
        """Where the pressures are, as shares of the length from a."""
        return np.asarray(((0.0 if self.gives("a") else 0.5) + np.arange(self.pressures)) * self.cell / self.length)

    def wave(self, p: Any, fluid: Fluid) -> tuple[Any, Any]:
        r"""Time l/a [s] that a wave travels from end to end, and its impedance \rho_0 a/A [Pa s/m^3], at p [Pa]."""
        speed = self.wave_speed(p, self.diameter, fluid)
        return self.length / speed, fluid.rho_0 * speed / self._area()

    def friction_drop(self, q: Any, p: Any, fluid: Fluid) -> Any:
        """Pressure [Pa] that steady flow q [m^3/s] loses from a to b, at p [Pa]."""
        return pipe_friction_drop(q, self.length, self.diameter, self.roughness, fluid, p, self.loss_coefficient)

    def inside(self, p: Expr, q: Expr, lags: Expr, at_a: Expr, at_b: Expr, fluid: Fluid) -> Equations:
        """All that the forms share, from the states and what each end receives: pressure, or flow into the line."""
        gives_a, gives_b = self.gives("a"), self.gives("b")
        around = stack(*([] if gives_a else [at_a]), p, *([] if gives_b else [at_b]))
        through = stack(*([at_a] if gives_a else []), q, *([-at_b] if gives_b else []))
        drop, inflow = around[:-1] - around[1:], through[:-1] - through[1:]
        mean: Any = (around[:-1] + around[1:]) / 2
        lengths, volumes = self._shares() * self.cell, self._shares(volumes=True) * self.cell * self._area()

        lag = terms_of(lags, self.friction_terms, self.flows)
        loss = self.loss_coefficient * lengths / self.length
        friction = pipe_friction_drop(q, lengths, self.diameter, self.roughness, fluid, mean, loss)
        power = friction * q
        if lag:
            friction = friction + lengths * added_gradient(q, lag, mean, self.diameter, fluid)
            power = power + lengths * lag_loss(q, lag, mean, self.diameter, fluid)
        inertia = 1 + added_inertia(self.friction_terms)
        swell = fluid.rho_0 / fluid.density(p)
        rate = swell * inflow / (volumes * self.softness(p, self.diameter, fluid))
        inner, inner_rate = self._beside(p), self._beside(rate)
        square = moving(q, lag, self.friction_terms)
        kinetic = kinetic_energy(fluid.rho_0 * lengths / self._area(), square, inner, fluid)
        at_rest = fluid.density(mean) * fluid.kinematic_viscosity(mean) * self._area()
        middle = total(p) / self.pressures
        return {
            "der_p_node": rate,
            "der_q_node": (drop - friction) * self._area() / (fluid.rho_0 * lengths * inertia),
            "der_q_lag": lagging_rates(q, lag, mean, self.diameter, fluid) if lag else lags,
            "q": through[0],
            "reynolds_number": reduce(maximum, fluid.rho_0 * fabs(q) * self.diameter / at_rest),
            "highest_frequency": ONE_PERCENT / pi * self.wave_speed(middle, self.diameter, fluid) / self.cell,
            "content": total(volumes * self.swelling(p, self.diameter) / swell),
            "stored_energy": total(volumes * self.energy_density(p, self.diameter, fluid)) + total(kinetic),
            "loss": total(heat(power, q, around[:-1], around[1:], inner, inner_rate, kinetic, fluid)),
        }

    def _beside(self, p: Any) -> Any:
        """For each flow the mean of the pressures beside it, of those that the line itself holds."""
        first = [] if self.gives("a") else [p[0]]
        last = [] if self.gives("b") else [p[-1]]
        return stack(*first, (p[:-1] + p[1:]) / 2, *last)

    def _shares(self, volumes: bool = False) -> np.ndarray:
        """Cells of each pressure's volume, or of each flow's column: half a cell at the ends that have it."""
        found = np.ones(self.pressures if volumes else self.flows)
        if self.gives("a") == volumes:
            found[0] /= 2
        if self.gives("b") == volumes:
            found[-1] /= 2
        return found

    def _area(self) -> Any:
        return pi / 4 * self.diameter * self.diameter


class DistributedLineTakesTakes(DistributedLine):
    """Distributed line that takes the pressure at both ends.

    Equations, symbols, limits and Source: :class:`DistributedLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = takes_pressure("second end")

    def equations(self, p_node: Expr, q_node: Expr, q_lag: Expr, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        return {"q_a": q_node[0], "q_b": -q_node[-1]} | self.inside(p_node, q_node, q_lag, p_a, p_b, fluid)


class DistributedLineTakesGives(DistributedLine):
    """Distributed line that takes the pressure at a and gives it at b.

    Equations, symbols, limits and Source: :class:`DistributedLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = gives_pressure("second end")

    def equations(self, p_node: Expr, q_node: Expr, q_lag: Expr, p_a: Expr, q_b: Expr, fluid: Fluid) -> Equations:
        return {"q_a": q_node[0], "p_b": p_node[-1]} | self.inside(p_node, q_node, q_lag, p_a, q_b, fluid)


class DistributedLineGivesTakes(DistributedLine):
    """Distributed line that gives the pressure at a and takes it at b.

    Equations, symbols, limits and Source: :class:`DistributedLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = takes_pressure("second end")

    def equations(self, p_node: Expr, q_node: Expr, q_lag: Expr, q_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        return {"p_a": p_node[0], "q_b": -q_node[-1]} | self.inside(p_node, q_node, q_lag, q_a, p_b, fluid)


class DistributedLineGivesGives(DistributedLine):
    """Distributed line that gives the pressure at both ends.

    Equations, symbols, limits and Source: :class:`DistributedLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = gives_pressure("second end")

    def equations(self, p_node: Expr, q_node: Expr, q_lag: Expr, q_a: Expr, q_b: Expr, fluid: Fluid) -> Equations:
        return {"p_a": p_node[0], "p_b": p_node[-1]} | self.inside(p_node, q_node, q_lag, q_a, q_b, fluid)
