"""Pumps and motors as makers rate them: a displacement and losses, without the ripple of their single chambers."""

from typing import Any

from pydantic import BaseModel, Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure, takes_rotation, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, fabs, tanh
from crescentlab.units import Displacement, Flow, Power, Ratio, Speed, Torque


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
        slip = self.leakage_coefficient * size / viscosity * rise
        drag = self.drag_coefficient * viscosity * size * omega
        friction = self.friction_coefficient * size * fabs(rise) + self.friction_torque
        torque = setting * size * rise + drag + friction * tanh(omega / self.creep_speed)
        volume_flow = setting * size * omega - slip
        q = fluid.density(mean) / fluid.rho_0 * volume_flow
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

    .. math:: q = \frac{\rho}{\rho_0} \left(D \omega - C_s \frac{D}{\mu} \Delta p\right), \quad
              T = D \Delta p + C_d \mu D \omega + (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{out} - p_{in}

    D = `displacement` [m^3/rad]; q [m^3/s] from inlet to outlet; T [N m] of the shaft on the pump; \omega [rad/s]; p
    [Pa, gauge]; C_s = `leakage_coefficient`, C_d = `drag_coefficient`, C_f = `friction_coefficient` [-]; T_c =
    `friction_torque` [N m]; \omega_t = `creep_speed` [rad/s]; \mu [Pa s], \rho [kg/m^3] at the mean pressure: there D
    is measured, so that the shaft's work without losses is that of compressing and moving the oil, to (\Delta
    p/\beta)^2/24 of it, which is then in the loss. The law holds in all four quadrants. Not for ripple
    (`swash_plate_barrel`, `crescent_gears`), a starved inlet, or leakage to a case: join a `laminar_gap` from the
    outlet to the case. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors (1950); H. E. Merritt,
    Hydraulic Control Systems (1967), chapter 4.
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

    .. math:: q = \frac{\rho}{\rho_0} \left(D \omega + C_s \frac{D}{\mu} \Delta p\right), \quad
              -T = D \Delta p - C_d \mu D \omega - (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{in} - p_{out}

    -T [N m] torque that the motor gives to its shaft; q [m^3/s] from inlet to outlet, \omega [rad/s], p [Pa, gauge] and
    all else as in `fixed_displacement_pump`, whose law this is. Not for ripple, nor for the friction of starting from
    rest, which is larger. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors (1950); H. E. Merritt,
    Hydraulic Control Systems (1967), chapter 4.
    """


class VariableDisplacementPump(_Rated, Component):
    r"""Pump whose displacement a signal sets, over centre too; ideal where its loss coefficients are zero.

    .. math:: q = \frac{\rho}{\rho_0} \left(\alpha D \omega - C_s \frac{D}{\mu} \Delta p\right), \quad
              T = \alpha D \Delta p + C_d \mu D \omega + (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{out} - p_{in}

    \alpha [-] = `setting`, share of the largest displacement D = `displacement` [m^3/rad], held within -1 and 1; q
    [m^3/s] from inlet to outlet; T [N m] of the shaft on the pump; \omega [rad/s], p [Pa, gauge] and all else as in
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

    .. math:: q = \frac{\rho}{\rho_0} \left(\alpha D \omega + C_s \frac{D}{\mu} \Delta p\right), \quad
              -T = \alpha D \Delta p - C_d \mu D \omega - (C_f D |\Delta p| + T_c) \tanh\frac{\omega}{\omega_t}, \quad
              \Delta p = p_{in} - p_{out}

    \alpha [-] = `setting`, held within -1 and 1; -T [N m] torque that the motor gives to its shaft; q [m^3/s] from
    inlet to outlet; D [m^3/rad], \omega [rad/s], p [Pa, gauge] and all else as in `variable_displacement_pump`, whose
    law this is. At \alpha = 0 it holds no load. Source: W. E. Wilson, Positive-Displacement Pumps and Fluid Motors
    (1950).
    """
