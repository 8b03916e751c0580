"""The line as a pure delay, by the method of characteristics on whole ticks: a family of four causal forms."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, held, observable, state, stores, takes_pressure, undecided_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, every, fabs, pi, stack, total
from crescentlab.units import Flow, Length, Pressure, PressureDifference, Ratio, Time, Volume

from .delay_waves import Waves, joined, without_overshoot
from .flow_laws import friction_times_reynolds
from .frequency_friction import MOST_TERMS, WEIGHTS, lag_step, shear, terms_of, unit_lag
from .line_walls import LineWall
from .two_ports import line_series, two_port_of
from .vapour_cavities import CavityEnd, cavity_end, cavity_events

HIGH, ALIKE = 100e5, 0.8
"""Pressure [Pa] at which free air hardly slows waves, and the least share of their speed there told as constant."""


def _start_waves(line: "TransmissionLine", fluid: Fluid | None, way: int) -> np.ndarray:
    """Steady waves of every cell, towards b (way 1) or a (-1): p + Z q or p - Z q, p falling from lump to lump."""
    if fluid is None:
        return np.full(line.cells, line.start_pressure)
    passed = (np.arange(line.cells) + 1) // 2
    p = line.start_pressure - float(np.squeeze(_start_drops(line, fluid)[0])) * passed
    return np.asarray(p + way * line.impedance(fluid) * line.start_flow)


def _start_to_b(line: "TransmissionLine", fluid: Fluid | None = None) -> np.ndarray:
    return _start_waves(line, fluid, 1)


def _start_to_a(line: "TransmissionLine", fluid: Fluid | None = None) -> np.ndarray:
    return _start_waves(line, fluid, -1)


def _start_sent_a(line: "TransmissionLine", fluid: Fluid | None = None) -> float:
    return float(_start_to_b(line, fluid)[0])


def _start_sent_b(line: "TransmissionLine", fluid: Fluid | None = None) -> float:
    return float(_start_to_a(line, fluid)[-1])


def _start_drops(line: "TransmissionLine", fluid: Fluid | None = None) -> np.ndarray:
    if fluid is None:
        return np.zeros(line.lumps)
    q: Any = line.start_flow
    return np.full(line.lumps, float(line.resistance(q, fluid) * q))


@dataclass(frozen=True)
class Losses:
    """Of the lumps at the last tick."""

    q: Any
    """flows [m^3/s]"""
    drop: Any
    """losses [Pa]"""
    q_lag: Any
    """lagging flows [m^3/s], term by term"""


@dataclass(frozen=True)
class Books:
    """Of both ends: fluid taken in until now and until the last tick [m^3], and waves sent at the last tick [Pa]."""

    into_a: Any
    into_b: Any
    had_a: Any
    had_b: Any
    sent_a: Any
    sent_b: Any


class TransmissionLine(LineWall, Component):
    r"""Straight line as a pure delay of its waves, friction in lumps between; the method of characteristics.

    .. math:: p_a - Z q_a = w_b(t - T), \quad p_b - Z q_b = w_a(t - T), \quad w = p + Z q, \qquad
              T = l/a, \quad Z = \rho_0 a/A

    without friction. p [Pa] gauge; q [m^3/s] mass flow over \rho_0, into the line at both ends; l = `length` [m];
    A = \pi d^2/4 [m^2], d = `diameter` [m]; a = [\rho ((1 + C p_m)/\beta + C)]^{-1/2} [m/s], C [1/Pa] compliance of an
    elastic wall, d/(e E) [2 e (1 + \mu)/d + c d/(d + e)], 0 if rigid, e = `wall_thickness` [m], E = `youngs_modulus`
    [Pa], \mu = `poisson_ratio` [-], c [-] = 1 between expansion joints, 1 - \mu^2 anchored throughout, 1 - \mu/2
    upstream; \rho [kg/m^3], \beta [Pa], \nu [m^2/s] constant, those at p_m = `mean_pressure`. n = `lumps` of friction
    stand at (2 i - 1) l/(2 n), each with l/n of the losses: friction of steady flow, all regimes (Churchill),
    `loss_coefficient` on the dynamic head, and what laminar friction adds when flow changes, by `friction_terms` terms
    of Kagawa's fit, 0 for none. The delay is 2 n ticks of T/(2 n) exactly, so at ticks waves arrive as they were sent;
    between ticks they are parabolas that keep the mean, so the fluid in the line changes by what its ends take in,
    exactly. Fronts stay sharp to a tick; waves of less than 7 ticks per period may be taken for fronts. An end that
    gives its pressure answers flow at once, p = w + Z q, so between it and an orifice must stand a volume.
    Such an end opens a vapour cavity, of volume `cavity_a` or `cavity_b` [m^3], rather than fall below the vapour
    pressure; in fluid without vapour the run ends at absolute zero. A front takes a tick, so the volume is known to a
    few ticks of flow: more `lumps` make it finer. An end that takes its pressure leaves cavities to the volume there.
    It keeps no books of energy: of what passes an end between two ticks only the fluid is summed up, and waves of one
    density and impedance carry p q, not the power of a fluid that can be compressed.
    Not for cavities inside the line, away from its ends (`distributed_line`), for aerated oil over a wide range of
    pressures, whose wave speed varies (`lax_wendroff_line`), nor for unsteady friction of turbulent flow.
    Source: Wylie & Streeter, Fluid Transients in Systems (1993), chapter 3, section 3-4, and on column separation;
    P. Krus, K. Weddfelt, J.-O. Palmberg, J. Dyn. Sys. Meas. Control 116 (1994) 132-136; Zielke (1968); Kagawa et al.
    (1983).
    """

    family: ClassVar[bool] = True

    length: Length = Field(gt=0, description="length")
    diameter: Length = Field(gt=0, description="inner diameter")
    mean_pressure: Pressure = Field(description="pressure at which wave speed, density and viscosity are taken")
    lumps: int = Field(default=10, ge=1, description="lumps of friction; the delay has twice as many ticks")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness; 0 is smooth")
    loss_coefficient: Ratio = Field(default=0.0, ge=0, description="entry, exit and bends, on the dynamic head")
    friction_terms: int = Field(
        default=0, ge=0, le=MOST_TERMS, description="terms of the frequency-dependent laminar friction; 0 is steady"
    )
    start_pressure: Pressure = Field(default=0.0, description="pressure at a at the start, lower towards b by friction")
    start_flow: Flow = Field(default=0.0, description="flow from a to b at the start")

    a = undecided_pressure("first end")
    b = undecided_pressure("second end")
    b_begin = held(PressureDifference, "waves to b of each cell when the tick began", start=_start_to_b, size="cells")
    b_end = held(PressureDifference, "waves to b of each cell when the tick ended", start=_start_to_b, size="cells")
    b_mean = held(PressureDifference, "waves to b of each cell, mean over the tick", start=_start_to_b, size="cells")
    a_begin = held(PressureDifference, "waves to a of each cell when the tick began", start=_start_to_a, size="cells")
    a_end = held(PressureDifference, "waves to a of each cell when the tick ended", start=_start_to_a, size="cells")
    a_mean = held(PressureDifference, "waves to a of each cell, mean over the tick", start=_start_to_a, size="cells")
    sent_a = held(PressureDifference, "wave sent by end a at the last tick", start=_start_sent_a)
    sent_b = held(PressureDifference, "wave sent by end b at the last tick", start=_start_sent_b)
    q_lump = held(Flow, "flow through each lump at the last tick", start="start_flow", size="lumps")
    drop = held(PressureDifference, "loss of each lump at the last tick", start=_start_drops, size="lumps")
    q_lag = held(Flow, "flows lagging behind those of the lumps, term by term", start="start_flow", size="lagging")
    t_node = held(Time, "time of the last tick", counts=True)
    into_a = state(Volume, "fluid taken in at a since the start", nominal=1e-8, counts=True)
    into_b = state(Volume, "fluid taken in at b since the start", nominal=1e-8, counts=True)
    had_a = held(Volume, "into_a at the last tick", counts=True)
    had_b = held(Volume, "into_b at the last tick", counts=True)
    q = observable(Flow, "flow from a to b, at a")
    content = stores()

    @property
    def cells(self) -> int:
        """Cells, which is ticks per delay: two per lump."""
        return 2 * self.lumps

    @property
    def lagging(self) -> int:
        """Number of lagging flows."""
        return self.friction_terms * self.lumps

    @property
    def area(self) -> Any:
        """Area of the bore [m^2]."""
        return pi * self.diameter * self.diameter / 4

    def two_port(self, omega: Any, p_mean: float, q_mean: float, fluid: Fluid) -> Any:
        """Flows into the line per end pressures [m^3/(s Pa)] at omega [rad/s], shape (m, 2, 2): the exact waves.

        The losses are linearised and spread over the length; symbols and Source: :mod:`.two_ports`.
        """
        spread = self.loss_coefficient / self.length
        series = line_series(omega, self.diameter, self.roughness, fluid, p_mean, q_mean, spread)
        return two_port_of(series, self.shunt(omega, p_mean, self.diameter, fluid), self.length)

    def remarks(self, stop: float, fluid: Fluid | None = None) -> list[str]:
        """What the line cannot show in this fluid: a wave speed that varies, and cavities away from its ends."""
        if fluid is None:
            return []
        remarks, high = [], max(self.mean_pressure, HIGH)
        pressures: Any = (0.0, high)
        slow, fast = (float(self.wave_speed(p, self.diameter, fluid)) for p in pressures)
        if slow < ALIKE * fast:
            remarks.append(
                f"its waves run at {float(self.speed(fluid)):.4g} m/s, the speed at its mean_pressure of "
                f"{self.mean_pressure / 1e5:.4g} bar, whatever the pressure; in this fluid they run at {slow:.4g} m/s "
                f"at 0 bar and at {fast:.4g} m/s at {high / 1e5:.4g} bar, and gas released along the line is left out; "
                "lax_wendroff_line follows the speed"
            )
        if fluid.cavity_pressure is not None:
            remarks.append(
                f"its fluid evaporates at {float(fluid.cavity_pressure) / 1e5:.4g} bar: a cavity opens only at an end "
                "that gives its pressure, cavities inside the line are left out; distributed_line shows them"
            )
        return remarks

    def speed(self, fluid: Fluid) -> Any:
        """a [m/s], constant."""
        p: Any = self.mean_pressure
        return self.wave_speed(p, self.diameter, fluid)

    def impedance(self, fluid: Fluid) -> Any:
        """Z [Pa s/m^3]."""
        return fluid.rho_0 * self.speed(fluid) / self.area

    def tick(self, fluid: Fluid) -> Any:
        """Time [s] that a wave takes through one cell."""
        return self.length / (self.cells * self.speed(fluid))

    def resistance(self, q: Expr, fluid: Fluid) -> Any:
        """Loss of a lump over its flow [Pa s/m^3] when the flow is steady."""
        p: Any = self.mean_pressure
        rho, nu, d = fluid.density(p), fluid.kinematic_viscosity(p), self.diameter
        v = fluid.rho_0 * fabs(q) / (rho * self.area)
        viscous = friction_times_reynolds(v * d / nu, self.roughness / d) * nu * self.length / (2 * d * d)
        return (viscous + self.loss_coefficient * v / 2) * fluid.rho_0 / (self.area * self.lumps)

    def at_rest(self, fluid: Fluid) -> Any:
        """Density over that at 0 bar gauge [-]."""
        p: Any = self.mean_pressure
        return fluid.density(p) / fluid.rho_0

    def with_cavity(self, end: str, at: CavityEnd, volume: Expr, is_open: Expr, fluid: Fluid) -> Equations:
        """How the cavity of an end grows, opens and closes."""
        bore = self.area * self.length
        growth = {f"der_cavity_{end}": at.growth / self.at_rest(fluid)}
        return growth | cavity_events(end, volume, is_open, bore, fluid)

    def lump_drops(self, begin: Expr, end: Expr, before: "Losses", fluid: Fluid) -> tuple[Any, "Losses"]:
        r"""Losses of the lumps [Pa] when the tick began, and all of them when it ended, from those of the tick before.

        .. math:: 2 Z q' + R(q') q' + S \sum_k m_k (q' - u_k') = \Delta w

        \Delta w = `begin`, `end` [Pa], waves arriving from a less those from b; R at the flow found with R of the tick
        before; S = (4 \nu \rho_0/(R^2 A)) l/n. What a front changes as the tick begins meets the same resistance.
        """
        p: Any = self.mean_pressure
        dt, q = self.tick(fluid), before.q
        lags = terms_of(before.q_lag, self.friction_terms, self.lumps)
        steps = [lag_step(k, dt, p, self.diameter, fluid) for k in range(len(lags))]
        scale = shear(p, self.diameter, fluid) * self.length / self.lumps
        added: Any = scale * unit_lag(self.friction_terms, dt, p, self.diameter, fluid)
        drive = end + added * q
        for weight, (kept, share), lag in zip(WEIGHTS, steps, lags, strict=False):
            drive = drive - scale * weight * (kept * (q - lag) - share * q)
            added = added + scale * weight * share
        hard = 2 * self.impedance(fluid) + added
        at_begin = q + (begin - 2 * self.impedance(fluid) * q - before.drop) / (hard + self.resistance(q, fluid))
        first = drive / (hard + self.resistance(q, fluid))
        found: Any = drive / (hard + self.resistance(first, fluid))
        behind = [kept * (q - lag) + share * (found - q) for (kept, share), lag in zip(steps, lags, strict=True)]
        q_lag = stack(*[found - each for each in behind]) if lags else before.q_lag
        twice = 2 * self.impedance(fluid)
        return begin - twice * at_begin, Losses(found, end - twice * found, q_lag)

    def stepped(
        self, to_b: Waves, to_a: Waves, losses: "Losses", books: "Books", q_a: Any, q_b: Any, t: Expr, fluid: Fluid
    ) -> Equations:
        """What all forms share, from the flows into the line: the fluid taken in, and how the waves step on."""
        p: Any = self.mean_pressure
        Z, dt, area = self.impedance(fluid), self.tick(fluid), self.area
        soft = self.at_rest(fluid) * self.softness(p, self.diameter, fluid)
        taken_a, taken_b = books.into_a - books.had_a, books.into_b - books.had_b
        from_a, from_b = to_b[:-1], to_a[1:]
        begin, end = (from_a.begin - from_b.begin)[::2], (from_a.end - from_b.end)[::2]
        at_begin, now = self.lump_drops(begin, end, losses, fluid)
        loss = _between(at_begin), _between(now.drop), _between((at_begin + now.drop) / 2)
        gain = -loss[0], -loss[1], -loss[2]
        left_a = Waves(books.sent_a, to_a.end[0] + 2 * Z * q_a, to_a.mean[0] + 2 * Z * taken_a / dt)
        left_b = Waves(books.sent_b, to_b.end[-1] + 2 * Z * q_b, to_b.mean[-1] + 2 * Z * taken_b / dt)
        next_b = joined(without_overshoot(left_a, to_b[0]), from_a.shifted(*gain))
        next_a = joined(from_b.shifted(*loss), without_overshoot(left_b, to_a[-1]))
        pressure = total(to_a.mean + to_b.mean) / (2 * self.cells)
        at_mean = self.at_rest(fluid) * self.swelling(p, self.diameter)
        return {
            "der_into_a": q_a,
            "der_into_b": q_b,
            "q": q_a,
            "content": area * self.length * (at_mean + soft * (pressure - p)) + taken_a + taken_b,
            "tick_over": every(
                dt, b_begin=next_b.begin, b_end=next_b.end, b_mean=next_b.mean, a_begin=next_a.begin,
                a_end=next_a.end, a_mean=next_a.mean, sent_a=left_a.end, sent_b=left_b.end, q_lump=now.q, drop=now.drop,
                q_lag=now.q_lag, t_node=t, had_a=books.into_a, had_b=books.into_b,
            ),
        }  # fmt: skip


def _between(lumps: Any) -> Any:
    """One value per node between the cells, from one per lump: every second node has none."""
    n = lumps.shape[0]
    return stack(*[value for k in range(n) for value in ([lumps[k], 0.0] if k < n - 1 else [lumps[k]])])


class TransmissionLineTakesTakes(TransmissionLine):
    """Transmission line that takes the pressure at both ends.

    Equations, symbols, limits and Source: :class:`TransmissionLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = takes_pressure("second end")

    def equations(
        self, b_begin: Expr, b_end: Expr, b_mean: Expr, a_begin: Expr, a_end: Expr, a_mean: Expr, sent_a: Expr,
        sent_b: Expr, q_lump: Expr, drop: Expr, q_lag: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr,
        had_b: Expr, p_a: Expr, p_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_b, to_a = Waves(b_begin, b_end, b_mean), Waves(a_begin, a_end, a_mean)
        share, Z = (t - t_node) / self.tick(fluid), self.impedance(fluid)
        q_a = (p_a - to_a[0].at(share)) / Z
        q_b = (p_b - to_b[-1].at(share)) / Z
        books = Books(into_a, into_b, had_a, had_b, sent_a, sent_b)
        losses = Losses(q_lump, drop, q_lag)
        return {"q_a": q_a, "q_b": q_b} | self.stepped(to_b, to_a, losses, books, q_a, q_b, t, fluid)


class TransmissionLineTakesGives(TransmissionLine):
    """Transmission line that takes the pressure at a and gives it at b.

    Equations, symbols, limits and Source: :class:`TransmissionLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = gives_pressure("second end")
    cavity_b = state(Volume, "vapour cavity at b", nominal=1e-8, counts=True)
    open_b = held(Ratio, "1 while the cavity at b is open", counts=True)

    def equations(
        self, b_begin: Expr, b_end: Expr, b_mean: Expr, a_begin: Expr, a_end: Expr, a_mean: Expr, sent_a: Expr,
        sent_b: Expr, q_lump: Expr, drop: Expr, q_lag: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr,
        had_b: Expr, cavity_b: Expr, open_b: Expr, p_a: Expr, q_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_b, to_a = Waves(b_begin, b_end, b_mean), Waves(a_begin, a_end, a_mean)
        share, Z = (t - t_node) / self.tick(fluid), self.impedance(fluid)
        q_a = (p_a - to_a[0].at(share)) / Z
        at_b = cavity_end(to_b[-1].at(share), Z, q_b, open_b, fluid)
        books = Books(into_a, into_b, had_a, had_b, sent_a, sent_b)
        losses = Losses(q_lump, drop, q_lag)
        shared = self.stepped(to_b, to_a, losses, books, q_a, at_b.q, t, fluid)
        shared |= self.with_cavity("b", at_b, cavity_b, open_b, fluid)
        shared["content"] -= self.at_rest(fluid) * cavity_b
        return {"q_a": q_a, "p_b": at_b.p} | shared


class TransmissionLineGivesTakes(TransmissionLine):
    """Transmission line that gives the pressure at a and takes it at b.

    Equations, symbols, limits and Source: :class:`TransmissionLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = takes_pressure("second end")
    cavity_a = state(Volume, "vapour cavity at a", nominal=1e-8, counts=True)
    open_a = held(Ratio, "1 while the cavity at a is open", counts=True)

    def equations(
        self, b_begin: Expr, b_end: Expr, b_mean: Expr, a_begin: Expr, a_end: Expr, a_mean: Expr, sent_a: Expr,
        sent_b: Expr, q_lump: Expr, drop: Expr, q_lag: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr,
        had_b: Expr, cavity_a: Expr, open_a: Expr, q_a: Expr, p_b: Expr, t: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_b, to_a = Waves(b_begin, b_end, b_mean), Waves(a_begin, a_end, a_mean)
        share, Z = (t - t_node) / self.tick(fluid), self.impedance(fluid)
        at_a = cavity_end(to_a[0].at(share), Z, q_a, open_a, fluid)
        q_b = (p_b - to_b[-1].at(share)) / Z
        books = Books(into_a, into_b, had_a, had_b, sent_a, sent_b)
        losses = Losses(q_lump, drop, q_lag)
        shared = self.stepped(to_b, to_a, losses, books, at_a.q, q_b, t, fluid)
        shared |= self.with_cavity("a", at_a, cavity_a, open_a, fluid)
        shared["content"] -= self.at_rest(fluid) * cavity_a
        return {"p_a": at_a.p, "q_b": q_b} | shared


class TransmissionLineGivesGives(TransmissionLine):
    """Transmission line that gives the pressure at both ends.

    Equations, symbols, limits and Source: :class:`TransmissionLine`; q [m^3/s], p [Pa].
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = gives_pressure("second end")
    cavity_a = state(Volume, "vapour cavity at a", nominal=1e-8, counts=True)
    open_a = held(Ratio, "1 while the cavity at a is open", counts=True)
    cavity_b = state(Volume, "vapour cavity at b", nominal=1e-8, counts=True)
    open_b = held(Ratio, "1 while the cavity at b is open", counts=True)

    def equations(
        self, b_begin: Expr, b_end: Expr, b_mean: Expr, a_begin: Expr, a_end: Expr, a_mean: Expr, sent_a: Expr,
        sent_b: Expr, q_lump: Expr, drop: Expr, q_lag: Expr, t_node: Expr, into_a: Expr, into_b: Expr, had_a: Expr,
        had_b: Expr, cavity_a: Expr, open_a: Expr, cavity_b: Expr, open_b: Expr, q_a: Expr, q_b: Expr, t: Expr,
        fluid: Fluid,
    ) -> Equations:  # fmt: skip
        to_b, to_a = Waves(b_begin, b_end, b_mean), Waves(a_begin, a_end, a_mean)
        share, Z = (t - t_node) / self.tick(fluid), self.impedance(fluid)
        at_a = cavity_end(to_a[0].at(share), Z, q_a, open_a, fluid)
        at_b = cavity_end(to_b[-1].at(share), Z, q_b, open_b, fluid)
        books = Books(into_a, into_b, had_a, had_b, sent_a, sent_b)
        losses = Losses(q_lump, drop, q_lag)
        shared = self.stepped(to_b, to_a, losses, books, at_a.q, at_b.q, t, fluid)
        shared |= self.with_cavity("a", at_a, cavity_a, open_a, fluid)
        shared |= self.with_cavity("b", at_b, cavity_b, open_b, fluid)
        shared["content"] -= self.at_rest(fluid) * (cavity_a + cavity_b)
        return {"p_a": at_a.p, "p_b": at_b.p} | shared
