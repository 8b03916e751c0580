"""Pumps and motors as makers rate them: a displacement and losses, without the ripple of their single chambers.

A chamber fills at the pressure of the port it fills from, and is closed with what it holds then. So a machine without
losses takes in D n by volume there, whatever the other port's pressure, and its torque is alpha D dp; the fluid in it
is compressed, or expands, against the other port at once, and the work of that is lost:

.. math:: P_l = \\alpha D \\omega \\int_{p_f}^{p_e} \\left(1 - \\frac{\\rho(p_f)}{\\rho(p)}\\right) dp \\ge 0

P_l [W]; p_f [Pa] of the port that fills, p_e of the one it empties to. The bracket has the sign of p - p_f, as dp has:
P_l is never negative, whether the machine pumps or motors and whichever way it turns. It is dp/(2 beta) of alpha D
omega dp, to first order.
"""

from typing import Any

from pydantic import BaseModel, Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure, takes_rotation, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fabs, maximum, minimum, tanh
from crescentlab.units import Displacement, Flow, Power, Ratio, Speed, Torque

from .flow_laws import referred_flow


class _Rated(BaseModel):
    """Displacement and Wilson's coefficients, and the law they belong to."""

    displacement: Displacement = Field(gt=0, description="largest volume displaced per angle of the shaft")
    leakage_coefficient: Ratio = Field(default=0.0, ge=0, description="C_s, laminar slip; 0 is none, typically 4e-9")
    drag_coefficient: Ratio = Field(default=0.0, ge=0, description="C_d, viscous drag; 0 is none, typically 5e4")
    friction_coefficient: Ratio = Field(default=0.0, ge=0, description="C_f, friction under pressure; 0.01 to 0.05")
    friction_torque: Torque = Field(default=0.0, ge=0, description="T_c, friction without pressure, as of seals")
    creep_speed: Speed = Field(default=1.0, gt=0, description="width of the rounding of friction at rest")

    def _law(self, setting: Any, p_inlet: Any, p_outlet: Any, omega: Any, fluid: Fluid) -> Equations:
        """Flow from inlet to outlet, torque on the machine, and powers."""
        rise, mean = p_outlet - p_inlet, (p_inlet + p_outlet) / 2
        viscosity, size = fluid.dynamic_viscosity(mean), self.displacement
        slip = referred_flow(self.leakage_coefficient * size / viscosity * rise, mean, fluid)
        drag = self.drag_coefficient * viscosity * size * omega
        friction = self.friction_coefficient * size * fabs(rise) + self.friction_torque
        torque = setting * size * rise + drag + friction * tanh(omega / self.creep_speed)
        displaced = setting * size * omega
        fills_inlet, fills_outlet = maximum(displaced, 0.0), minimum(displaced, 0.0)
        q = referred_flow(fills_inlet, p_inlet, fluid) + referred_flow(fills_outlet, p_outlet, fluid) - slip
        power = fluid.rho_0 * q * (fluid.enthalpy(p_outlet) - fluid.enthalpy(p_inlet))
        return {
            "q_inlet": q,
            "q_outlet": -q,
            "torque_shaft": torque,
            "q": q,
            "torque": torque,
            "hydraulic_power": power,
            "loss": torque * omega - power,
        }


class FixedDisplacementPump(_Rated, Component):
    r"""Pump of fixed displacement with laminar slip, viscous drag and friction; ideal where these are zero.

    .. math:: q = \frac{\rho_f}{\rho_0} D \omega - \frac{\rho_m}{\rho_0} C_s \frac{D}{\mu} \Delta p, \quad
              T = D \Delta p + C_d \mu D \omega + (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{out} - p_{in}

    D = `displacement` [m^3/rad]; q [m^3/s] from inlet to outlet; T [N m] of the shaft on the pump; \omega [rad/s]; p
    [Pa, gauge]; C_s = `leakage_coefficient`, C_d = `drag_coefficient`, C_f = `friction_coefficient` [-]; T_c =
    `friction_torque` [N m]; \omega_t = `creep_speed` [rad/s]; \rho_f [kg/m^3] at the port that fills, the inlet for
    \omega > 0 and the outlet for \omega < 0; \mu [Pa s], \rho_m at the mean pressure, \rho_0 at 0 bar gauge. An ideal
    pump thus draws D \omega by volume whatever its outlet's pressure: its volumetric and hydromechanical efficiencies
    are 1. What fills is compressed at the outlet: about \Delta p/(2 \beta) of the power, in the `loss`, which is never
    negative. The law holds in all four quadrants. Not for ripple (`swash_plate_barrel`, `crescent_gears`), a starved
    inlet, or leakage to a case: join a `laminar_gap` from the outlet to the case. Source: W. E. Wilson,
    Positive-Displacement Pumps and Fluid Motors (1950); H. E. Merritt, Hydraulic Control Systems (1967), chapter 4.
    """

    inlet = takes_pressure("inlet")
    outlet = takes_pressure("outlet")
    shaft = takes_rotation("the shaft")
    q = observable(Flow, "flow from inlet to outlet")
    torque = observable(Torque, "torque of the shaft on the machine, positive while pumping")
    hydraulic_power = observable(Power, "power given to the oil, negative while motoring")
    loss = dissipates()

    def equations(self, p_inlet: Expr, p_outlet: Expr, omega_shaft: Expr, fluid: Fluid) -> Equations:
        return self._law(1.0, p_inlet, p_outlet, omega_shaft, fluid)


class FixedDisplacementMotor(FixedDisplacementPump):
    r"""Motor of fixed displacement with laminar slip, viscous drag and friction; ideal where these are zero.

    .. math:: q = \frac{\rho_f}{\rho_0} D \omega + \frac{\rho_m}{\rho_0} C_s \frac{D}{\mu} \Delta p, \quad
              -T = D \Delta p - C_d \mu D \omega - (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{in} - p_{out}

    -T [N m] torque that the motor gives to its shaft; q [m^3/s] from inlet to outlet, \omega [rad/s], p [Pa, gauge] and
    all else as in `fixed_displacement_pump`, whose law this is. It fills at the inlet's high pressure, and what it
    closes in expands at once as the outlet opens. Not for ripple, nor for the friction of starting from rest, which is
    larger. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors (1950); H. E. Merritt, Hydraulic Control
    Systems (1967), chapter 4.
    """


class VariableDisplacementPump(_Rated, Component):
    r"""Pump whose displacement a signal sets, over centre too; ideal where its loss coefficients are zero.

    .. math:: q = \frac{\rho_f}{\rho_0} \alpha D \omega - \frac{\rho_m}{\rho_0} C_s \frac{D}{\mu} \Delta p, \quad
              T = \alpha D \Delta p + C_d \mu D \omega + (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{out} - p_{in}

    \alpha [-] = `setting`, share of the largest displacement D = `displacement` [m^3/rad], held within -1 and 1; q
    [m^3/s] from inlet to outlet; T [N m] of the shaft on the pump; \omega [rad/s], p [Pa, gauge]; \rho_f
    [kg/m^3] at the port that fills, the inlet for \alpha \omega > 0, else the outlet; all else as in
    `fixed_displacement_pump`. Gaps and friction stay those of the full machine. Not for the dynamics of the setting:
    put a filter of first or second order before it. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors
    (1950); W. M. J. Schloesser, Hydraulic Power Transmission 7 (1961), losses that do not follow the setting.
    """

    inlet = takes_pressure("inlet")
    outlet = takes_pressure("outlet")
    shaft = takes_rotation("the shaft")
    setting = takes_signal(Ratio, "share of the largest displacement", low=-1, high=1)
    q = observable(Flow, "flow from inlet to outlet")
    torque = observable(Torque, "torque of the shaft on the machine, positive while pumping")
    hydraulic_power = observable(Power, "power given to the oil, negative while motoring")
    loss = dissipates()

    def equations(self, p_inlet: Expr, p_outlet: Expr, omega_shaft: Expr, setting: Expr, fluid: Fluid) -> Equations:
        return self._law(setting, p_inlet, p_outlet, omega_shaft, fluid)


class VariableDisplacementMotor(VariableDisplacementPump):
    r"""Motor whose displacement a signal sets; ideal where its loss coefficients are zero.

    .. math:: q = \frac{\rho_f}{\rho_0} \alpha D \omega + \frac{\rho_m}{\rho_0} C_s \frac{D}{\mu} \Delta p, \quad
              -T = \alpha D \Delta p - C_d \mu D \omega - (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{in} - p_{out}

    \alpha [-] = `setting`, held within -1 and 1; -T [N m] torque that the motor gives to its shaft; q [m^3/s] from
    inlet to outlet; D [m^3/rad], \omega [rad/s], p [Pa, gauge] and all else as in `variable_displacement_pump`, whose
    law this is. At \alpha = 0 it holds no load. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors
    (1950).
    """
