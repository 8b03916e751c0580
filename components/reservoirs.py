"""Reservoirs with a free surface."""

from typing import Any

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_pressure, gives_signal, state, stores, stores_energy, supplies
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fail_when, gauss_legendre, ones, total
from crescentlab.units import Acceleration, Area, Length, Pressure

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


class Reservoir(Component):
    r"""Reservoir with a free surface, whose level follows what flows in and out; the head acts on its outlet.

    .. math:: A \frac{dh}{dt} = \sum q_{out} + \sum q_{in}, \quad p_{out} = p_s + \rho_0 g (h - h_o), \quad p_{in} = p_s

    h [m] level above the floor, starting at `start_level`; A = `area` [m^2] of the surface; q [m^3/s] into the
    reservoir, mass flow over \rho_0 [kg/m^3]; p_s = `surface_pressure` [Pa] gauge; h_o = `outlet_height` [m]; g =
    `gravity` [m/s^2]. The `inlets`, as many as wanted, end above the surface. The run ends when the level falls below
    the outlet, which would draw air, or rises above `height`. Stored: A h [m^3] at 0 bar gauge; energy of height above
    the outlet A/g \int_{p_s}^{p_{out}} (p_{out} - p)/\rho(p)\,dp [J], which is \rho_0 g A (h - h_o)^2/2 but for the
    fluid's compression. Supplied: what `inlets` bring by ending above the surface, \rho_0 q_{in} (w(p_{out}) - w(p_s))
    [W], less what is pushed against p_s. Not for sloshing, foam, nor the velocity of the fluid within. Source:
    hydrostatics and conservation of mass; emptying through an orifice: E. Torricelli, De motu aquarum (1644).
    """

    area: Area = Field(gt=0, description="area of the surface")
    height: Length = Field(gt=0, description="level at which it overflows")
    start_level: Length = Field(ge=0, description="level at the start")
    outlet_height: Length = Field(default=0.0, ge=0, description="height of the outlet above the floor")
    surface_pressure: Pressure = Field(default=0.0, description="gauge pressure above the surface")
    inlets: int = Field(default=0, ge=0, description="number of pipes that end above the surface")
    gravity: Acceleration = Field(default=GRAVITY, gt=0, description="acceleration along the outlet's axis of height")

    outlet = gives_pressure("below the surface, passable both ways")
    inlet = gives_pressure("pipes that end above the surface", size="inlets")
    level = gives_signal(Length, "level above the floor")
    h = state(Length, "level above the floor", start="start_level", nominal=1e-2)
    content = stores("fluid in the reservoir, as volume at 0 bar gauge")
    stored_energy = stores_energy("energy of the fluid by its height above the outlet")
    supply = supplies("power by the height of the inlets, less work against the pressure above the surface")

    def equations(self, h: Expr, q_outlet: Expr, q_inlet: Expr, fluid: Fluid) -> Equations:
        surface: Any = self.surface_pressure
        mass_flow = fluid.rho_0 * total(q_inlet)
        p_outlet = surface + fluid.rho_0 * self.gravity * (h - self.outlet_height)
        above = fluid.enthalpy(surface)
        head = gauss_legendre(lambda p: (p_outlet - p) / fluid.density(p), surface, p_outlet)
        return {
            "p_outlet": p_outlet,
            "p_inlet": self.surface_pressure * ones(self.inlets),
            "level": h,
            "der_h": (q_outlet + total(q_inlet)) / self.area,
            "content": self.area * h,
            "stored_energy": self.area / self.gravity * head,
            "supply": mass_flow * (fluid.enthalpy(p_outlet) - above) - (mass_flow + fluid.rho_0 * q_outlet) * above,
            "runs_dry": fail_when(
                h < self.outlet_height, "the outlet draws air; raise start_level or return more to the reservoir"
            ),
            "overflows": fail_when(h > self.height, "the reservoir overflows; raise height or lower start_level"),
        }
