"""Pumps and motors with rated losses."""

from __future__ import annotations

import math

from crescentlab.components.displacement_machines import (
    FixedDisplacementMotor,
    FixedDisplacementPump,
    VariableDisplacementMotor,
    VariableDisplacementPump,
)
from crescentlab.components.fluids import SimpleOil

from evidence import Number, evidence

BAR, RPM = 1e5, math.pi / 30
OIL = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1e15)
REV = 1e-6 / (2 * math.pi)
LOSSES = {"leakage_coefficient": 3e-9, "drag_coefficient": 1e5, "friction_coefficient": 0.03}


@evidence(
    "fixed_displacement_pump",
    "fixed_displacement_motor",
    "variable_displacement_pump",
    "variable_displacement_motor",
    source="flow V n and torque V dp/(2 pi); the power of the shaft is that of the oil",
    tolerance=1e-6,
    because="rounding of the expected values to seven digits; the oil is stiff",
)
def ideal() -> list[Number]:
    """71 cc/rev at 1500 rpm and 200 bar: 106.5 L/min and 225.9999 N m; a variable machine set to 0.4; a motor."""
    given = {"omega_shaft": 1500 * RPM, "fluid": OIL}
    pump = FixedDisplacementPump(displacement=71 * REV).equations(p_inlet=0.0, p_outlet=200 * BAR, **given)
    motor = FixedDisplacementMotor(displacement=71 * REV).equations(p_inlet=200 * BAR, p_outlet=0.0, **given)
    part = VariableDisplacementPump(displacement=71 * REV)
    variable = part.equations(p_inlet=0.0, p_outlet=200 * BAR, setting=0.4, **given)
    part = VariableDisplacementMotor(displacement=71 * REV)
    driven = part.equations(p_inlet=200 * BAR, p_outlet=0.0, setting=0.4, **given)
    flow, torque = 71e-6 * 25, 225.99997
    return [
        Number("flow of the pump", flow, pump["q"], "L/min"),
        Number("torque of the pump", torque, pump["torque"], "N m"),
        Number("power of the oil over that of the shaft", 1.0, pump["hydraulic_power"] / (torque * 1500 * RPM)),
        Number("torque on the motor", -torque, motor["torque"], "N m"),
        Number("flow through the motor", flow, motor["q"], "L/min"),
        Number("flow of the variable pump", 0.4 * flow, variable["q"], "L/min"),
        Number("torque on the variable motor", -0.4 * torque, driven["torque"], "N m"),
    ]


@evidence(
    "fixed_displacement_pump",
    "variable_displacement_pump",
    source="Wilson (1950) with s = mu omega/dp: eta_v = 1 - C_s/(a s), eta_t = a/(a + C_f + C_d s), a the setting; "
    "eta = eta_v eta_t",
    tolerance=1e-7,
    because="the oil yields by 1e-8; the friction is rounded only near standstill",
)
def pump_efficiency() -> list[Number]:
    """C_s 3e-9, C_d 1e5, C_f 0.03 at 25.5 mPa s, 1500 rpm, 200 bar, so s = 2.003e-7; at full setting and at 0.5."""
    omega, rise = 1500 * RPM, 200 * BAR
    s = 0.0255 * omega / rise
    fixed = FixedDisplacementPump(displacement=71 * REV, **LOSSES)
    full = fixed.equations(p_inlet=0.0, p_outlet=rise, omega_shaft=omega, fluid=OIL)
    variable = VariableDisplacementPump(displacement=71 * REV, **LOSSES)
    half = variable.equations(p_inlet=0.0, p_outlet=rise, omega_shaft=omega, setting=0.5, fluid=OIL)
    found = []
    for what, a, now in (("full", 1.0, full), ("half", 0.5, half)):
        volumetric, mechanical = 1 - 3e-9 / (a * s), a / (a + 0.03 + 1e5 * s)
        overall = now["hydraulic_power"] / (now["torque"] * omega)
        found += [
            Number(f"volumetric, {what}", volumetric, now["q"] / (a * 71e-6 * 25)),
            Number(f"mechanical, {what}", mechanical, a * 71 * REV * rise / now["torque"]),
            Number(f"overall, {what}", volumetric * mechanical, overall),
        ]
    return found


@evidence(
    "fixed_displacement_motor",
    "variable_displacement_motor",
    source="Wilson (1950) with s = mu omega/dp: eta_v = 1/(1 + C_s/(a s)), eta_t = 1 - (C_f + C_d s)/a",
    tolerance=1e-7,
    because="the oil yields by 1e-8; the friction is rounded only near standstill",
)
def motor_efficiency() -> list[Number]:
    """The same machine as a motor, at full setting and at 0.5."""
    omega, drop = 1500 * RPM, 200 * BAR
    s = 0.0255 * omega / drop
    fixed = FixedDisplacementMotor(displacement=71 * REV, **LOSSES)
    full = fixed.equations(p_inlet=drop, p_outlet=0.0, omega_shaft=omega, fluid=OIL)
    variable = VariableDisplacementMotor(displacement=71 * REV, **LOSSES)
    half = variable.equations(p_inlet=drop, p_outlet=0.0, omega_shaft=omega, setting=0.5, fluid=OIL)
    found = []
    for what, a, now in (("full", 1.0, full), ("half", 0.5, half)):
        volumetric, mechanical = 1 / (1 + 3e-9 / (a * s)), 1 - (0.03 + 1e5 * s) / a
        overall = -now["torque"] * omega / -now["hydraulic_power"]
        found += [
            Number(f"volumetric, {what}", volumetric, a * 71e-6 * 25 / now["q"]),
            Number(f"mechanical, {what}", mechanical, -now["torque"] / (a * 71 * REV * drop)),
            Number(f"overall, {what}", volumetric * mechanical, overall),
        ]
    return found


@evidence(
    "fixed_displacement_pump",
    "variable_displacement_motor",
    source="ISO 4391: capacity at the port that fills; work per mass between two pressures, the integral of dp/rho, "
    "beta (1/rho_in - 1/rho_out) for rho = rho_0 exp(p/beta)",
    tolerance=1e-9,
    because="rounding; the loss is a difference of two powers, a hundred times as large",
)
def compression() -> list[Number]:
    """An ideal pump from 0 to 250 bar, oil of 1.4 GPa; a motor set to 0.4, from 250 bar to 0, which fills at 250."""
    oil = SimpleOil(density=850.0, kinematic_viscosity=30e-6, bulk_modulus=1.4e9)
    now = FixedDisplacementPump(displacement=71 * REV).equations(
        p_inlet=0.0, p_outlet=250 * BAR, omega_shaft=1500 * RPM, fluid=oil
    )
    driven = VariableDisplacementMotor(displacement=71 * REV).equations(
        p_inlet=250 * BAR, p_outlet=0.0, omega_shaft=1500 * RPM, setting=0.4, fluid=oil
    )
    thinner, flow = math.exp(-250 * BAR / 1.4e9), 71e-6 * 25
    work = 1.4e9 * (1 - thinner)  # per volume at 0 bar
    return [
        Number("drawn by the pump", flow, now["q_inlet"], "L/min"),
        Number("delivered, by volume at 250 bar", flow * thinner, now["q"] * 850.0 / oil.density(250 * BAR), "L/min"),
        Number("torque of the pump", 71 * REV * 250 * BAR, now["torque"], "N m"),
        Number("power of its oil", flow * work, now["hydraulic_power"], "W"),
        Number("lost by compression", flow * (250 * BAR - work), now["loss"], "W"),
        Number("taken by the motor, by volume at 250 bar", 0.4 * flow, driven["q"] * thinner, "L/min"),
        Number("lost by expansion", 0.4 * flow * (work / thinner - 250 * BAR), driven["loss"], "W"),
    ]
