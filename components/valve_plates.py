"""Axial piston machines: the barrel that strokes the pistons, their chambers, the valve plate that joins them."""

from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_chamber,
    gives_pressure,
    observable,
    reads_rotation,
    state,
    stores,
    stores_energy,
    supplies,
    takes_chamber,
    takes_pressure,
    takes_rotation,
    takes_signal,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, atan2, cos, fabs, maximum, minimum, pi, sin, tan, total, where
from crescentlab.units import Angle, Area, Displacement, Flow, Length, Pressure, Ratio, Time, Torque, Volume

from .flow_laws import orifice_flow


def piston_angles(phi: Any, start_angle: Any, pistons: int) -> Any:
    """Angles [rad] of the pistons from their outer dead centre; each follows 2 pi/z behind the one before it."""
    return phi - start_angle - 2 * pi / pistons * np.arange(pistons)


class SwashPlateBarrel(Component):
    r"""Barrel of an axial piston machine on a fixed swash plate: shapes a chamber for each piston.

    .. math:: V_i = V_0 + A R \tan\beta\, (1 + \cos\alpha_i), \quad \dot V_i = -\omega A R \tan\beta \sin\alpha_i, \quad
              T = A R \tan\beta \sum_i p_i \sin\alpha_i, \quad \alpha_i = \varphi - \varphi_0 - 2\pi (i - 1)/z

    V [m^3] of chamber i = 1 ... z, z = `pistons`; V_0 = `dead_volume` [m^3] at the inner dead centre; A = \pi d^2/4
    [m^2], d = `piston_diameter`; R = `pitch_radius` [m]; \beta = `swash_angle` [rad]; \varphi [rad], \omega [rad/s] of
    the shaft; \varphi_0 = `start_angle` [rad] of the shaft where piston 1 is at its outer dead centre; p [Pa, gauge]; T
    [N m] of the shaft on the barrel. With \omega > 0 a piston delivers for \alpha from 0 to \pi. `kinematic_flow`
    [m^3/s] is the sum of -\dot V_i over the pistons that deliver, what an incompressible oil and an ideal valve plate
    would give; from its largest to its smallest value it varies by \pi/(2z) tan(\pi/(4z)) of its mean with an odd
    number of pistons and by \pi/z tan(\pi/(2z)) with an even one. No power is lost. Not for friction, nor for the
    torque on the plate. Source: J. Ivantysyn, M. Ivantysynova, Hydrostatic Pumps and Motors (2001), kinematics of swash
    plate machines and non-uniformity of flow; N. D. Manring, J. Dyn. Syst. Meas. Control 122 (2000) 263-268.
    """

    lossless: ClassVar[bool] = True

    pistons: int = Field(default=9, ge=1, description="number of pistons, z")
    piston_diameter: Length = Field(gt=0, description="diameter of a piston")
    pitch_radius: Length = Field(gt=0, description="radius of the circle on which the pistons lie")
    swash_angle: Angle = Field(gt=0, lt=pi / 2, description="inclination of the swash plate")
    dead_volume: Volume = Field(gt=0, description="volume of a chamber at the inner dead centre")
    start_angle: Angle = Field(default=0.0, description="angle of the shaft where piston 1 is at its outer dead centre")

    shaft = takes_rotation("the barrel")
    chambers = gives_chamber("chambers of the pistons", size="pistons")
    torque = observable(Torque, "torque of the shaft on the barrel, positive while pumping")
    kinematic_flow = observable(Flow, "sum of the rates at which the delivering chambers shrink")
    displacement = observable(Displacement, "volume displaced per shaft angle")

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, p_chambers: Expr) -> Equations:
        angles = piston_angles(phi_shaft, self.start_angle, self.pistons)
        area = pi / 4 * self.piston_diameter * self.piston_diameter
        half_stroke_volume = area * self.pitch_radius * tan(self.swash_angle)
        rates = -half_stroke_volume * sin(angles)
        torque = -total(p_chambers * rates)
        return {
            "V_chambers": self.dead_volume + half_stroke_volume * (1 + cos(angles)),
            "dV_chambers": rates * omega_shaft,
            "torque_shaft": torque,
            "torque": torque,
            "kinematic_flow": total(maximum(-rates * omega_shaft, 0.0)),
            "displacement": self.pistons * half_stroke_volume / pi,
        }


class VariableSwashPlateBarrel(Component):
    r"""Barrel of an axial piston machine whose swash plate follows a signal with a lag, over centre too.

    .. math:: V_i = V_0 + A R \tan\beta_m (1 + s \cos\alpha_i), \quad
              \dot V_i = A R \tan\beta_m (\dot s \cos\alpha_i - s\, \omega \sin\alpha_i), \quad
              \frac{ds}{dt} = \frac{u - s}{\tau}, \quad T = s A R \tan\beta_m \sum_i p_i \sin\alpha_i

    s [-] = tan of the swash angle over that of \beta_m = `largest_swash_angle` [rad]; u [-] the signal `setting`, held
    within -1 and 1; \tau = `lag` [s] of the actuator, which imposes the motion whatever the force of the pistons; V_0 =
    `dead_volume` [m^3] at the inner dead centre of the full stroke, the plate tilting about the middle of the strokes;
    V [m^3], A [m^2], R [m], \alpha [rad], T [N m], p [Pa, gauge] as in `swash_plate_barrel`. Supplied by the actuator:
    -A R \tan\beta_m \dot s \sum_i p_i \cos\alpha_i [W]; none is lost. Not for the control force of the plate. Source:
    J. Ivantysyn, M. Ivantysynova, Hydrostatic Pumps and Motors (2001), kinematics of swash plate machines.
    """

    pistons: int = Field(default=9, ge=1, description="number of pistons, z")
    piston_diameter: Length = Field(gt=0, description="diameter of a piston")
    pitch_radius: Length = Field(gt=0, description="radius of the circle on which the pistons lie")
    largest_swash_angle: Angle = Field(gt=0, lt=pi / 2, description="inclination of the swash plate at full setting")
    dead_volume: Volume = Field(gt=0, description="volume of a chamber at its smallest, with the full stroke")
    lag: Time = Field(default=20e-3, gt=0, description="time constant of the actuator")
    start_setting: Ratio = Field(default=0.0, ge=-1, le=1, description="setting at the start")
    start_angle: Angle = Field(default=0.0, description="angle of the shaft where piston 1 is at its outer dead centre")

    shaft = takes_rotation("the barrel")
    chambers = gives_chamber("chambers of the pistons", size="pistons")
    setting = takes_signal(Ratio, "share of the largest displacement", low=-1, high=1)
    share = state(Ratio, "share of the largest displacement", start="start_setting", nominal=1.0)
    torque = observable(Torque, "torque of the shaft on the barrel, positive while pumping")
    displacement = observable(Displacement, "volume displaced per shaft angle")
    supply = supplies("power of the actuator that changes the strokes")

    def equations(self, phi_shaft: Expr, omega_shaft: Expr, p_chambers: Expr, setting: Expr, share: Expr) -> Equations:
        angles = piston_angles(phi_shaft, self.start_angle, self.pistons)
        area = pi / 4 * self.piston_diameter * self.piston_diameter
        half_stroke_volume = area * self.pitch_radius * tan(self.largest_swash_angle)
        moves = (setting - share) / self.lag
        rates = -half_stroke_volume * share * sin(angles)
        torque = -total(p_chambers * rates)
        swivelling = half_stroke_volume * moves * cos(angles)
        return {
            "V_chambers": self.dead_volume + half_stroke_volume * (1 + share * cos(angles)),
            "dV_chambers": rates * omega_shaft + swivelling,
            "der_share": moves,
            "torque_shaft": torque,
            "torque": torque,
            "displacement": self.pistons * half_stroke_volume * share / pi,
            "supply": -total(p_chambers * swivelling),
        }


class PistonChambers(Component):
    r"""Chambers of the pistons of one barrel: as many volumes of compressible fluid, shaped by the barrel.

    .. math:: \frac{dp_i}{dt} = \frac{\beta}{V_i} \left(\frac{\rho_0}{\rho} q_i - \dot V_i\right)

    p [Pa, gauge]; V [m^3] > 0, \dot V [m^3/s] of each chamber from the barrel; q [m^3/s] into it; \rho [kg/m^3], \beta
    [Pa] at p. Stored: the sum of V \rho/\rho_0 [m^3], energy V e(p) [J]. Not for a single chamber
    (`variable_capacity`). Source: Rundo & Corvaglia (2016), Eq. 2, with \rho_0/\rho because q is a mass flow.
    """

    pistons: int = Field(default=9, ge=1, description="number of pistons")
    start_pressure: Pressure = Field(default=0.0, description="pressure of all chambers at the start")

    port = gives_pressure("the chambers", size="pistons")
    chambers = takes_chamber("the barrel that shapes them", size="pistons")
    p = state(Pressure, "pressures", start="start_pressure", nominal=1e5, size="pistons")
    content = stores()
    stored_energy = stores_energy("energy of the fluid in all chambers")

    def equations(self, p: Expr, q_port: Expr, V_chambers: Expr, dV_chambers: Expr, fluid: Fluid) -> Equations:
        swell = fluid.rho_0 / fluid.density(p)
        return {
            "p_port": p,
            "p_chambers": p,
            "der_p": fluid.bulk_modulus(p) / V_chambers * (swell * q_port - dV_chambers),
            "content": total(V_chambers / swell),
            "stored_energy": total(V_chambers * fluid.energy_density(p)),
        }


class ValvePlate(Component):
    r"""Valve plate of an axial piston machine: kidney ports that each chamber meets once per turn.

    .. math:: q_i = C_d A_i \sqrt{2\rho|\Delta p|}/\rho_0\; \mathrm{sign}\,\Delta p, \quad
              A_i = \max\!\left(R w \min(h - |\delta_i|, \kappa, 2h - \kappa),\;
              A_n \min\left(1, \frac{\delta_i + h + \nu}{\nu}\right)\right)

    q [m^3/s] from chamber i to a port, C_d and \rho [kg/m^3] as in `orifice`; \delta [rad] angle of the piston from the
    middle of the port, |\delta| < \pi; 2 h [rad] from where the port opens to where it closes (`delivery_opens` ...,
    angles of the piston from its outer dead centre; with the defaults they change over just at the dead centres);
    \kappa = `kidney_angle` [rad] and w = `kidney_width` [m] of the barrel's kidneys, with radial edges, R =
    `pitch_radius` [m]; \nu = `groove_angle` [rad], A_n = `groove_area` [m^2] of the groove ahead of each port, that
    joins the first half of it; all areas not below 0. Opening one port before the other closes joins them. Finite
    Jacobian at zero drop and area. Not for the gap between barrel and plate: join an `axial_face_gap`. Source: J.
    Ivantysyn, M. Ivantysynova, Hydrostatic Pumps and Motors (2001), design of valve plates; orifice law of Rundo &
    Corvaglia (2016), Eqs. 27-29.
    """

    pistons: int = Field(default=9, ge=1, description="number of pistons")
    pitch_radius: Length = Field(gt=0, description="radius of the circle on which the kidneys lie")
    kidney_width: Length = Field(gt=0, description="radial width of the kidneys")
    kidney_angle: Angle = Field(gt=0, lt=pi, description="angle over which a kidney of the barrel extends")
    delivery_opens: Angle = Field(default=0.0, description="angle of the piston at which it meets the delivery port")
    delivery_closes: Angle = Field(default=pi, description="angle of the piston at which it leaves the delivery port")
    suction_opens: Angle = Field(default=pi, description="angle of the piston at which it meets the suction port")
    suction_closes: Angle = Field(default=2 * pi, description="angle of the piston at which it leaves the suction port")
    groove_angle: Angle = Field(default=0.1, gt=0, lt=1.0, description="angle by which a groove runs ahead of its port")
    groove_area: Area = Field(default=0.0, ge=0, description="flow area of a groove where its port opens; 0 is none")
    start_angle: Angle = Field(default=0.0, description="angle of the shaft where piston 1 is at its outer dead centre")
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")

    chambers = takes_pressure("chambers of the pistons", size="pistons")
    suction = takes_pressure("suction port")
    delivery = takes_pressure("delivery port")
    shaft = reads_rotation("the barrel")
    q = observable(Flow, "flow from the chambers to the delivery port")
    q_suction_port = observable(Flow, "flow from the suction port to the chambers")
    delivery_areas = observable(Area, "flow areas to the delivery port", size="pistons")
    suction_areas = observable(Area, "flow areas to the suction port", size="pistons")
    loss = dissipates()

    @model_validator(mode="after")
    def _ports_fit(self) -> Self:
        for name in ("delivery", "suction"):
            span = getattr(self, f"{name}_closes") - getattr(self, f"{name}_opens")
            degrees = 180 / pi
            if not self.kidney_angle < span < 2 * pi - 2 * self.groove_angle:
                raise ValueError(
                    f"{name}_closes must lie more than kidney_angle ({self.kidney_angle * degrees:.4g} deg) and less "
                    f"than a turn without two grooves after {name}_opens, not {span * degrees:.4g} deg"
                )
            if self.groove_area > self.pitch_radius * self.kidney_width * min(
                self.kidney_angle, span - self.kidney_angle
            ):
                raise ValueError("groove_area exceeds the area of a kidney; write the area where the port opens")
        return self

    def equations(
        self, p_chambers: Expr, p_suction: Expr, p_delivery: Expr, phi_shaft: Expr, fluid: Fluid
    ) -> Equations:
        angles = piston_angles(phi_shaft, self.start_angle, self.pistons)
        open_d = self._areas(angles, self.delivery_opens, self.delivery_closes)
        open_s = self._areas(angles, self.suction_opens, self.suction_closes)
        out = orifice_flow(p_chambers, p_delivery, open_d, None, self.cd_max, self.lambda_c, fluid)
        back = orifice_flow(p_chambers, p_suction, open_s, None, self.cd_max, self.lambda_c, fluid)
        return {
            "q_chambers": out + back,
            "q_delivery": -total(out),
            "q_suction": -total(back),
            "q": total(out),
            "q_suction_port": -total(back),
            "delivery_areas": open_d,
            "suction_areas": open_s,
        }

    def _areas(self, angles: Any, opens: Any, closes: Any) -> Any:
        """Flow areas [m^2] to one port; the angle jumps by a turn opposite the port, where all is closed."""
        half, turned = (closes - opens) / 2, angles - (opens + closes) / 2
        delta = atan2(sin(turned), cos(turned))
        widest = minimum(self.kidney_angle, 2 * half - self.kidney_angle)
        kidney = self.pitch_radius * self.kidney_width * minimum(maximum(half - fabs(delta), 0.0), widest)
        share = minimum(maximum((delta + half + self.groove_angle) / self.groove_angle, 0.0), 1.0)
        return maximum(kidney, where(delta < 0, self.groove_area * share, 0.0))
