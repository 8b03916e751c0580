"""Short pipes of lumped inertia, resistance and capacity (IRC). Lines with travelling waves are not here."""

from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_pressure,
    state,
    stores,
    stores_energy,
    takes_pressure,
    undecided_pressure,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, pi
from crescentlab.units import Flow, Length, Pressure, PressureDifference, Ratio

from .flow_laws import pipe_friction_drop
from .line_energy import heat, kinetic_energy
from .two_ports import line_series, line_shunt, two_port_of
from .wave_laws import impedance, wave_speed


@dataclass(frozen=True)
class Column:
    """A share of the fluid in a pipe, moving as one."""

    acceleration: Any
    """dq/dt [m^3/s^2]"""
    kinetic: Any
    """its energy of motion [J]"""
    loss: Any
    """what it turns into heat [W]"""


class Pipe(Component):
    r"""Short pipe with inertia, friction and compressibility, lumped; its ends fit what they meet.

    .. math:: \frac{\rho_0 l}{A} \frac{dq}{dt} = \Delta p - \left(f \frac{l}{d} + K\right) \frac{\rho v|v|}{2}, \quad
              \frac{dp}{dt} = \frac{\beta}{A l} \frac{\rho_0}{\rho} \sum q, \quad v = \frac{\rho_0 q}{\rho A}

    l = `length`, d = `diameter` [m], A = \pi d^2/4 [m^2]; p [Pa] gauge; q [m^3/s] mass flow over \rho_0, so the
    momentum l d(\rho_0 q)/dt is exact and waves run at sqrt(\beta/\rho); f [-] Darcy factor of Churchill (1977)
    for all regimes; K = `loss_coefficient` [-] on the dynamic head; \rho [kg/m^3], \beta [Pa].
    An end that meets a volume takes its pressure (inertial), an end that meets an orifice gives one (capacitive).
    Energy: A l e(p) of the compressed fluid and \tfrac12 \rho A l v^2 of its motion [J]; lost is friction times volume
    flow [W], booked together with what the lump's one density and the convective term left out do not tell, of the
    order of \Delta p/\beta and v/a of the motion's power and of either sign.
    Not for frequencies near the first mode of the pipe, a/(4 l) with one open end, nor for walls that stretch.
    Source: lumped line of inertia, resistance and capacity, as the IRC ducts of Rundo & Corvaglia (2016), section 5.
    """

    family: ClassVar[bool] = True

    length: Length = Field(gt=0, description="length")
    diameter: Length = Field(gt=0, description="inner diameter")
    roughness: Length = Field(default=0.0, ge=0, description="height of the wall's roughness; 0 is smooth")
    loss_coefficient: Ratio = Field(default=0.0, ge=0, description="entry, exit and bends, on the dynamic head")

    a = undecided_pressure("first end")
    b = undecided_pressure("second end")
    p = state(Pressure, "mean pressure", start=0.0, nominal=1e5)
    q = state(Flow, "mean flow from a to b", start=0.0, nominal=1e-3 / 60)
    content = stores()
    stored_energy = stores_energy()
    loss = dissipates()

    def two_port(self, omega: Any, p_mean: float, q_mean: float, fluid: Fluid) -> Any:
        """Flows into the pipe per end pressures [m^3/(s Pa)] at omega [rad/s], shape (m, 2, 2): the travelling waves.

        The losses are linearised and spread over the length; symbols and Source: :mod:`.two_ports`.
        """
        spread = self.loss_coefficient / self.length
        series = line_series(omega, self.diameter, self.roughness, fluid, p_mean, q_mean, spread)
        return two_port_of(series, line_shunt(omega, self.diameter, fluid, p_mean), self.length)

    @property
    def lumps(self) -> int:
        """Lumps that the line is cut into: one."""
        return 1

    def wave(self, p: Any, fluid: Fluid) -> tuple[Any, Any]:
        r"""Time l/a [s] that a wave travels from end to end, and its impedance \rho_0 a/A [Pa s/m^3], at p [Pa]."""
        return self.length / wave_speed(p, fluid), impedance(p, pi / 4 * self.diameter * self.diameter, fluid)

    def friction_drop(self, q: Any, p: Any, fluid: Fluid) -> Any:
        """Pressure [Pa] that steady flow q [m^3/s] loses from a to b, at p [Pa]."""
        return pipe_friction_drop(q, self.length, self.diameter, self.roughness, fluid, p, self.loss_coefficient)

    def _volume(self) -> Any:
        """Volume of the bore [m^3]."""
        return pi / 4 * self.diameter * self.diameter * self.length

    def _filling(self, share: float, p: Expr, inflow: Expr, fluid: Fluid) -> Any:
        """dp/dt [Pa/s] of a share of the pipe's volume."""
        return fluid.bulk_modulus(p) / (share * self._volume()) * fluid.rho_0 / fluid.density(p) * inflow

    def _compressed(self, share: float, p: Expr, fluid: Fluid) -> Any:
        """Energy [J] of the fluid compressed in a share of the pipe's volume."""
        return share * self._volume() * fluid.energy_density(p)

    def _column(self, share: float, p_from: Expr, p_to: Expr, q: Expr, p: Expr, rate: Expr, fluid: Fluid) -> Column:
        """A share of the pipe's length, its energy taken with the density at p [Pa], which rises by `rate` [Pa/s]."""
        length = share * self.length
        mean, local = (p_from + p_to) / 2, share * self.loss_coefficient
        friction = pipe_friction_drop(q, length, self.diameter, self.roughness, fluid, mean, local)
        inertance = fluid.rho_0 * length / (pi / 4 * self.diameter * self.diameter)
        kinetic = kinetic_energy(inertance, q * q, p, fluid)
        loss = heat(friction * q, q, p_from, p_to, p, rate, kinetic, fluid)
        return Column((p_from - p_to - friction) / inertance, kinetic, loss)


class PipeInertialInertial(Pipe):
    r"""Pipe between two volumes: half the inertia, the capacity, half the inertia (T).

    .. math:: \frac{\rho_0 l}{2A} \frac{dq_1}{dt} = p_a - p - R(q_1), \quad
              \frac{dp}{dt} = \frac{\beta}{A l} \frac{\rho_0}{\rho} (q_1 - q_2), \quad
              \frac{\rho_0 l}{2A} \frac{dq_2}{dt} = p - p_b - R(q_2), \quad q_{1,2} = q \pm \tfrac12 s

    p [Pa] at the middle; q [m^3/s] mean flow, s = `surplus` [m^3/s] flow in at a less flow out at b; R [Pa]
    half of the pipe's losses; symbols as in `pipe`. Not for frequencies near the pipe's first mode.
    Source: lumped line, as `pipe`.
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = takes_pressure("second end")
    surplus = state(Flow, "flow in at a less flow out at b", start=0.0, nominal=1e-3 / 60)

    def equations(self, p_a: Expr, p_b: Expr, p: Expr, q: Expr, surplus: Expr, fluid: Fluid) -> Equations:
        q_1, q_2 = q + surplus / 2, q - surplus / 2
        rate = self._filling(1.0, p, surplus, fluid)
        one = self._column(0.5, p_a, p, q_1, p, rate, fluid)
        two = self._column(0.5, p, p_b, q_2, p, rate, fluid)
        return {
            "q_a": q_1,
            "q_b": -q_2,
            "der_p": rate,
            "der_q": (one.acceleration + two.acceleration) / 2,
            "der_surplus": one.acceleration - two.acceleration,
            "content": self._volume() * fluid.density(p) / fluid.rho_0,
            "stored_energy": self._compressed(1.0, p, fluid) + one.kinetic + two.kinetic,
            "loss": one.loss + two.loss,
        }


class PipeCapacitiveCapacitive(Pipe):
    r"""Pipe between two restrictions: half the capacity, the inertia, half the capacity (pi).

    .. math:: \frac{dp_1}{dt} = \frac{2\beta}{A l} \frac{\rho_0}{\rho} (q_a - q), \quad
              \frac{\rho_0 l}{A} \frac{dq}{dt} = p_1 - p_2 - R(q), \quad
              \frac{dp_2}{dt} = \frac{2\beta}{A l} \frac{\rho_0}{\rho} (q + q_b), \quad p_{1,2} = p \pm \tfrac12 d

    p [Pa] mean of the two ends, d = `drop` [Pa] pressure at a less that at b; q [m^3/s]; R [Pa] the pipe's
    losses; \beta and \rho at each end; symbols as in `pipe`. Not for frequencies near the pipe's first mode.
    Source: lumped line, as `pipe`.
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = gives_pressure("second end")
    drop = state(PressureDifference, "pressure at a less pressure at b", start=0.0, nominal=1e5)

    def equations(self, q_a: Expr, q_b: Expr, p: Expr, q: Expr, drop: Expr, fluid: Fluid) -> Equations:
        p_1, p_2 = p + drop / 2, p - drop / 2
        rate_1 = self._filling(0.5, p_1, q_a - q, fluid)
        rate_2 = self._filling(0.5, p_2, q_b + q, fluid)
        column = self._column(1.0, p_1, p_2, q, p, (rate_1 + rate_2) / 2, fluid)
        return {
            "p_a": p_1,
            "p_b": p_2,
            "der_p": (rate_1 + rate_2) / 2,
            "der_drop": rate_1 - rate_2,
            "der_q": column.acceleration,
            "content": self._volume() / 2 * (fluid.density(p_1) + fluid.density(p_2)) / fluid.rho_0,
            "stored_energy": self._compressed(0.5, p_1, fluid) + self._compressed(0.5, p_2, fluid) + column.kinetic,
            "loss": column.loss,
        }


class PipeCapacitiveInertial(Pipe):
    r"""Pipe from a restriction at a to a volume at b: the capacity, then the inertia.

    .. math:: \frac{dp}{dt} = \frac{\beta}{A l} \frac{\rho_0}{\rho} (q_a - q), \quad
              \frac{\rho_0 l}{A} \frac{dq}{dt} = p - p_b - R(q)

    p [Pa] at a; q [m^3/s] leaves at b; R [Pa] the pipe's losses; symbols as in `pipe`. Not for frequencies near
    the pipe's first mode, which this one lump puts at a/(2 \pi l) instead of a/(4 l).
    Source: lumped line, as `pipe`.
    """

    family: ClassVar[bool] = False

    a = gives_pressure("first end")
    b = takes_pressure("second end")

    def equations(self, q_a: Expr, p_b: Expr, p: Expr, q: Expr, fluid: Fluid) -> Equations:
        rate = self._filling(1.0, p, q_a - q, fluid)
        column = self._column(1.0, p, p_b, q, p, rate, fluid)
        return {
            "p_a": p,
            "q_b": -q,
            "der_p": rate,
            "der_q": column.acceleration,
            "content": self._volume() * fluid.density(p) / fluid.rho_0,
            "stored_energy": self._compressed(1.0, p, fluid) + column.kinetic,
            "loss": column.loss,
        }


class PipeInertialCapacitive(Pipe):
    r"""Pipe from a volume at a to a restriction at b: the inertia, then the capacity.

    .. math:: \frac{\rho_0 l}{A} \frac{dq}{dt} = p_a - p - R(q), \quad
              \frac{dp}{dt} = \frac{\beta}{A l} \frac{\rho_0}{\rho} (q + q_b)

    p [Pa] at b; q [m^3/s] enters at a; R [Pa] the pipe's losses; symbols as in `pipe`. Not for frequencies near
    the pipe's first mode, which this one lump puts at a/(2 \pi l) instead of a/(4 l).
    Source: lumped line, as `pipe`.
    """

    family: ClassVar[bool] = False

    a = takes_pressure("first end")
    b = gives_pressure("second end")

    def equations(self, p_a: Expr, q_b: Expr, p: Expr, q: Expr, fluid: Fluid) -> Equations:
        rate = self._filling(1.0, p, q + q_b, fluid)
        column = self._column(1.0, p_a, p, q, p, rate, fluid)
        return {
            "q_a": q,
            "p_b": p,
            "der_q": column.acceleration,
            "der_p": rate,
            "content": self._volume() * fluid.density(p) / fluid.rho_0,
            "stored_energy": self._compressed(1.0, p, fluid) + column.kinetic,
            "loss": column.loss,
        }
