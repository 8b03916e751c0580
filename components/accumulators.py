"""Volumes that two media share: gas accumulators, and separators between two fluids."""

from typing import Any

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, held, observable, state, stores, stores_energy
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, event_where, exp, fail_when, log, when, where
from crescentlab.units import Energy, Pressure, Ratio, Volume


class GasAccumulator(Component):
    r"""Gas accumulator with bladder, diaphragm or piston: polytropic gas behind a separator that stops at both ends.

    .. math:: \frac{dp}{dt} = \frac{\rho_0}{\rho} \frac{\sum q}{V_f/\beta + C}, \quad P V_g^n = P_0 V_0^n, \quad
              C = \frac{V_g}{n P}, \quad V_f = V_d + V_0 - V_g

    p [Pa] gauge, P = p + atmosphere [Pa]; V_g [m^3] gas, V_0 = `volume` of it at P_0, the `preload`; V_f [m^3] fluid,
    V_d = `dead_volume` of it in the neck; n = `polytropic_index` [-], 1 isothermal (a charge of minutes), 1.4 adiabatic
    (of seconds); q [m^3/s] into the accumulator, mass flow over \rho_0; \rho [kg/m^3]; \beta [Pa]. Below the preload
    the separator rests on the neck, and once the gas is down to V_0 times `smallest_gas` it rests at the other end; in
    both places C = 0 and the fluid alone gives way; the events `empties` and `fills` mark the stops. Stored: V_f
    \rho/\rho_0 [m^3]. `energy` [J] is the work done on the gas from P_0 on, P_0 V_0 ((V_0/V_g)^{n-1} - 1)/(n - 1) less
    that of the atmosphere, and stays what it is at a stop; stored in all: `energy` + V_f e(p) [J]. Not for heat
    exchange, the real gas above 200 bar, friction, nor for fluid that leaves the bladder slower than it is drawn.
    Source: polytropic law of a perfect gas; H. Murrenhoff, Grundlagen der Fluidtechnik, chapter on hydraulic
    accumulators; ISO 5596 for the terms.
    """

    volume: Volume = Field(gt=0, description="gas volume when empty of fluid, at the preload")
    preload: Pressure = Field(gt=0, description="gauge pressure of the gas when empty of fluid")
    polytropic_index: Ratio = Field(default=1.4, ge=1, description="polytropic index of the gas; 1 is isothermal")
    smallest_gas: Ratio = Field(default=0.1, gt=0, lt=1, description="gas volume at the full stop over volume")
    dead_volume: Volume = Field(default=10e-6, gt=0, description="fluid that always remains: neck and port")

    port = gives_pressure("the fluid side")
    p = state(Pressure, "pressure of the fluid", start=0.0, nominal=1e5)
    gas_volume = observable(Volume, "volume of the gas")
    gas_pressure = observable(Pressure, "gauge pressure of the gas")
    energy = observable(Energy, "work done on the gas since the preload")
    stored_energy = stores_energy("energy of the gas and of the fluid")
    bottomed = observable(Ratio, "-1 rests empty, 1 rests full, 0 works")
    content = stores()

    def equations(self, p: Expr, q_port: Expr, fluid: Fluid) -> Equations:
        atmosphere, n = fluid.atmospheric_pressure, self.polytropic_index
        lowest = self.preload + atmosphere
        full = lowest * self.smallest_gas ** (-n) - atmosphere
        empty, stopped = p <= self.preload, p >= full
        pressure = where(p > self.preload - lowest / 2, p + atmosphere, lowest / 2)  # finite wherever it is not in use
        working = self.volume * (lowest / pressure) ** (1 / n)
        gas: Any = event_where(empty, self.volume, event_where(stopped, self.volume * self.smallest_gas, working))
        compliance = event_where(empty, 0.0, event_where(stopped, 0.0, working / (n * pressure)))
        rests = event_where(empty, -1.0, event_where(stopped, 1.0, 0.0))
        at_rest = event_where(empty, self.preload, full)
        fluid_volume = self.dead_volume + self.volume - gas
        swell = fluid.rho_0 / fluid.density(p)
        work = lowest * self.volume * compression_work(self.volume / gas, n) - atmosphere * (self.volume - gas)
        return {
            "p_port": p,
            "der_p": swell * q_port / (fluid_volume / fluid.bulk_modulus(p) + compliance),
            "content": fluid_volume / swell,
            "gas_volume": gas,
            "gas_pressure": where(rests * rests > 0.5, at_rest, p),
            "energy": work,
            "stored_energy": work + fluid_volume * fluid.energy_density(p),
            "bottomed": rests,
            "empties": when(empty),
            "fills": when(stopped),
        }


def compression_work(ratio: Any, index: Any) -> Any:
    r"""Work [-] of compressing a gas by `ratio` = V_0/V, over P_0 V_0: (r^{n-1} - 1)/(n - 1), ln r for n = 1."""
    a = (index - 1) * log(ratio)
    small = a * a < 1e-8
    series = 1 + a / 2 + a * a / 6
    return log(ratio) * where(small, series, (exp(a) - 1) / where(small, 1.0, a))


class PistonSeparator(Component):
    r"""Piston without mass or friction between two fluids, with stops at both ends.

    .. math:: \dot p_a = \dot p_b = \frac{s_a \sum q_a + s_b \sum q_b}{V_a/\beta_a + V_b/\beta_b}, \quad
              \dot V_a = -\dot V_b = s_a \sum q_a - \frac{V_a}{\beta_a} \dot p_a, \quad s = \frac{\rho_0}{\rho(p)}

    p [Pa] gauge; V_a, V_b [m^3] of the two sides, together `volume` + 2 `dead_volume`; q [m^3/s] into a side, mass flow
    over \rho_0 of that side's fluid; \rho [kg/m^3], \beta [Pa] each of its own fluid, which may differ. A side that is
    used up to `dead_volume` stops the piston (`stops_at_a`, `stops_at_b`): the sides then have pressures of their own,
    until the pressure pushes the piston off (`leaves`). Stored: V_a \rho_a/\rho_{a0} + V_b \rho_b/\rho_{b0} [m^3];
    energy V_a e_a(p_a) + V_b e_b(p_b) [J]. Not for seal friction, nor the inertia of the piston: for those join two
    `piston_chamber` and a `mass_with_stops`.
    Source: Rundo & Corvaglia (2016), Eq. 2, for both sides, with p_a = p_b.
    """

    volume: Volume = Field(gt=0, description="displacement of the piston from stop to stop")
    dead_volume: Volume = Field(default=10e-6, gt=0, description="fluid that remains on a used-up side")
    share_a: Ratio = Field(
        default=0.5, ge=0, le=1, description="position at the start: 0 used up on side a, 1 on side b"
    )
    start_pressure: Pressure = Field(default=0.0, description="pressure of both sides at the start")

    a = gives_pressure("first fluid")
    b = gives_pressure("second fluid")
    pressure_a = state(Pressure, "pressure of side a", start="start_pressure", nominal=1e5)
    pressure_b = state(Pressure, "pressure of side b", start="start_pressure", nominal=1e5)
    V_a = state(Volume, "volume of side a", start=lambda c: c.dead_volume + c.share_a * c.volume, nominal=1e-6)
    at = held(Ratio, "-1 rests at side a's end, 1 at side b's, 0 free; -2 until the start is looked at", start=-2.0)
    V_b = observable(Volume, "volume of side b")
    content = stores()
    stored_energy = stores_energy("energy of both fluids")

    def equations(
        self, pressure_a: Expr, pressure_b: Expr, V_a: Expr, at: Expr, q_a: Expr, q_b: Expr, fluid_a: Fluid,
        fluid_b: Fluid,
    ) -> Equations:  # fmt: skip
        low, high = self.dead_volume, self.dead_volume + self.volume
        V_b = self.volume + 2 * self.dead_volume - V_a
        inflow_a = fluid_a.rho_0 / fluid_a.density(pressure_a) * q_a
        inflow_b = fluid_b.rho_0 / fluid_b.density(pressure_b) * q_b
        softness_a, softness_b = V_a / fluid_a.bulk_modulus(pressure_a), V_b / fluid_b.bulk_modulus(pressure_b)
        together = (inflow_a + inflow_b) / (softness_a + softness_b)
        free, common = at == 0, (pressure_a + pressure_b) / 2
        rests = where(V_a <= low, -1.0, where(V_a >= high, 1.0, 0.0))
        return {
            "p_a": pressure_a,
            "p_b": pressure_b,
            "der_pressure_a": where(free, together, inflow_a / softness_a),
            "der_pressure_b": where(free, together, inflow_b / softness_b),
            "der_V_a": where(free, inflow_a - softness_a * together, 0.0),
            "V_b": V_b,
            "content": V_a * fluid_a.density(pressure_a) / fluid_a.rho_0
            + V_b * fluid_b.density(pressure_b) / fluid_b.rho_0,
            "stored_energy": V_a * fluid_a.energy_density(pressure_a) + V_b * fluid_b.energy_density(pressure_b),
            "stops_at_a": when(free & (V_a < low), V_a=low, pressure_a=common, pressure_b=common, at=-1.0),
            "stops_at_b": when(free & (V_a > high), V_a=high, pressure_a=common, pressure_b=common, at=1.0),
            "leaves": when((at == -1) & (pressure_a > pressure_b) | (at == 1) & (pressure_a < pressure_b), at=0.0),
            "starts": when(at == -2, at=rests),
            "used_up": fail_when(
                (V_a < self.dead_volume / 2) | (V_b < self.dead_volume / 2),
                "a side has used up its dead volume; start V_a between the stops",
            ),
        }
