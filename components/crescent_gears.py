"""Gears of a crescent pump: the volumes they shape, their torque, and when they exist. No leakage, no pressures."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_chamber, gives_signal, held, observable, takes_rotation
from crescentlab.maths import Expr, pi, when
from crescentlab.units import Angle, Displacement, Length, Ratio, Torque, Volume

from .chambers import Chambers
from .involute import external_thickness, half_angle
from .meshing import Meshing, within

JUST_BEFORE = 1e-9
"""Angle [rad] before a jump at which a volume is looked at for its smallest value."""


class CrescentGears(Component):
    r"""Gears of a crescent pump: shape the delivery, suction and trapped volumes.

    .. math:: \frac{dV_d}{d\varphi} = \frac{H}{2} [\rho_{i1}^2 - R_{t1}^2 + \tau (R_{t2}^2 - \rho_{o1}^2)], \quad
              \frac{dV_s}{d\varphi} = \frac{H}{2} [R_{t1}^2 - \rho_{i2}^2 + \tau (\rho_{o2}^2 - R_{t2}^2)], \quad
              \frac{dV_t}{d\varphi} = -\frac{dV_d}{d\varphi} - \frac{dV_s}{d\varphi}

    .. math:: M = -\left(p_d \frac{dV_d}{d\varphi} + p_s \frac{dV_s}{d\varphi} + p_t \frac{dV_t}{d\varphi}\right)

    V [m^3]; phi [rad] angle of the driver's shaft; M [N m] torque of the shaft on the gears, positive while
    pumping; p [Pa, gauge]; H [m] thickness; R_t [m] tip radii; rho_i, rho_o [m] vector rays to the contacts P1 and
    P2 (see ``meshing``); tau [-] = z_1/z_2. nu_d [rad] runs from 0 to the pitch; the trapped volume exists for
    nu_d < nu_02 - nu_01, afterwards P2 = P1. A carry-over volume closes when a tooth's centre line passes the
    crescent's end at the suction side: there the suction volume jumps by a tooth space, where the last one opens
    the delivery volume does, where the trapped volume begins and ends the delivery and the suction do (see
    ``chambers``). ``driver_phase`` and ``driven_phase`` are phi plus a constant and pass through a whole number of
    pitches when a volume of that gear closes.

    The shaft's power is all given to the chambers: none is lost or stored.

    Not for a reversed shaft, contact ratios of 2 and more, or profile shift. Tip and root radii default to
    m z_1/2 + 3.1 mm, m z_1/2 - 4.05 mm and m z_2/2 - 3.4 mm, m z_2/2 + 3.6 mm.
    Source: Rundo & Corvaglia (2016), Eqs. 3-16 and section 6.1.
    """

    lossless: ClassVar[bool] = True

    driver_teeth: int = Field(default=13, ge=3, description="teeth of the driving inner gear, z_1")
    driven_teeth: int = Field(default=16, ge=4, description="teeth of the driven outer gear, z_2")
    module: Length = Field(default=4e-3, gt=0, description="normal module")
    pressure_angle: Angle = Field(default=32 * pi / 180, gt=0, lt=pi / 2, description="nominal pressure angle")
    eccentricity: Length = Field(default=6e-3, gt=0, description="distance of the gears' centres")
    thickness: Length = Field(default=13e-3, gt=0, description="axial thickness of the gears")
    driver_addendum: Length = Field(default=3.1e-3, gt=0, description="driver's tooth above its reference circle")
    driven_addendum: Length = Field(default=3.4e-3, gt=0, description="driven gear's tooth inside its reference circle")
    driver_dedendum: Length = Field(default=4.05e-3, gt=0, description="driver's root below its reference circle")
    driven_dedendum: Length = Field(default=3.6e-3, gt=0, description="driven gear's root outside its reference circle")
    driver_tip_radius: Length | None = Field(default=None, gt=0, description="R_t1, default from the addendum")
    driven_tip_radius: Length | None = Field(default=None, gt=0, description="R_t2, default from the addendum")
    driver_root_radius: Length | None = Field(default=None, gt=0, description="R_f1, default from the dedendum")
    driven_root_radius: Length | None = Field(default=None, gt=0, description="R_f2, default from the dedendum")
    crescent_extension: Angle = Field(default=34 * pi / 180, gt=0, lt=2 * pi, description="angle of the whole crescent")
    suction_share: Ratio = Field(default=0.5, ge=0, le=1, description="part of the crescent on the suction side")
    volumes: Literal["instantaneous", "mean"] = Field(
        default="instantaneous", description="volumes given: as they are at the angle, or their means"
    )
    delivery_volume_mean: Volume = Field(default=20e-6, gt=0, description="mean over a pitch, ducts included")
    suction_volume_mean: Volume = Field(default=45e-6, gt=0, description="mean over a pitch, ducts included")
    start_phase: Angle = Field(default=0.0, description="nu_d at shaft angle 0: 0 where a trapped volume begins")

    shaft = takes_rotation("driver's shaft")
    delivery = gives_chamber("delivery volume")
    suction = gives_chamber("suction volume")
    trapped = gives_chamber("trapped volume; a constant while it does not exist")
    exists = gives_signal(Ratio, "1 while the trapped volume exists, else 0")
    driver_phase = gives_signal(Angle, "shaft angle since a driver volume closed, plus whole pitches")
    driven_phase = gives_signal(Angle, "shaft angle since a driven volume closed, plus whole pitches")

    mesh_start = held(
        Angle, "shaft angle at which the running pitch began", start=lambda c: -c.phase_at_zero, counts=True
    )
    started = held(Ratio, "1 once mesh_start belongs to the shaft's angle", start=0.0)

    dVd = observable(Displacement, "delivery volume per shaft angle")
    dVs = observable(Displacement, "suction volume per shaft angle")
    dVt = observable(Displacement, "trapped volume per shaft angle")
    torque = observable(Torque, "torque of the shaft on the gears, positive while pumping")
    displacement = observable(Displacement, "mean volume displaced to delivery per shaft angle")
    nu_d = observable(Angle, "shaft angle since the running pitch began")

    def equations(
        self, phi_shaft: Expr, omega_shaft: Expr, mesh_start: Expr, started: Expr,
        p_delivery: Expr, p_suction: Expr, p_trapped: Expr,
    ) -> Equations:  # fmt: skip
        """Rates, volumes, torque and phases at the shaft's angle."""
        chambers = self.chambers
        mesh, H = chambers.mesh, self.thickness
        nu_d = phi_shaft - mesh_start
        exists = chambers.exists(nu_d)
        y_1 = nu_d + mesh.nu_01
        y_2 = y_1 + exists * mesh.pitch
        dVd, dVs = H * mesh.delivery_rate(y_1), -H * mesh.delivery_rate(y_2)
        dVt = -dVd - dVs
        torque = -(p_delivery * dVd + p_suction * dVs + p_trapped * dVt)
        V_d: Any
        V_s: Any
        V_d, V_s, V_t = self.delivery_volume_mean, self.suction_volume_mean, chambers.trapped_mean
        if self.volumes == "instantaneous":
            V_d = V_d + chambers.delivery_change(nu_d)
            V_s = V_s + chambers.suction_change(nu_d, exists)
            V_t = chambers.trapped(nu_d, exists)
        begin = self.phase_at_zero
        return {
            "V_delivery": V_d, "dV_delivery": dVd * omega_shaft,
            "V_suction": V_s, "dV_suction": dVs * omega_shaft,
            "V_trapped": V_t, "dV_trapped": dVt * omega_shaft,
            "exists": exists,
            "driver_phase": phi_shaft + within(begin - chambers.driver_closes, mesh.pitch),
            "driven_phase": phi_shaft + within(begin - chambers.driven_closes, mesh.pitch),
            "torque_shaft": torque, "torque": torque,
            "dVd": dVd, "dVs": dVs, "dVt": dVt,
            "displacement": chambers.displaced / mesh.pitch,
            "nu_d": nu_d,
            "begins": when(started == 0, mesh_start=phi_shaft - within(phi_shaft + begin, mesh.pitch), started=1.0),
            "meshes": when((started == 1) & (nu_d >= mesh.pitch), mesh_start=mesh_start + mesh.pitch),
        }  # fmt: skip

    @property
    def unbalanced(self) -> str:
        """Mean volumes stay as they are while what is displaced flows."""
        return "volumes: mean keeps its volumes as they are while they displace fluid" if self.volumes == "mean" else ""

    @property
    def chambers(self) -> Chambers:
        """The volumes over a pitch, and through ``chambers.mesh`` the contact geometry."""
        half_1, half_2 = self.module * self.driver_teeth / 2, self.module * self.driven_teeth / 2
        mesh = Meshing(
            self.driver_teeth, self.driven_teeth, self.module, self.pressure_angle, self.eccentricity,
            driver_tip=_given(self.driver_tip_radius, half_1 + self.driver_addendum),
            driven_tip=_given(self.driven_tip_radius, half_2 - self.driven_addendum),
        )  # fmt: skip
        return Chambers(
            mesh,
            driver_root=_given(self.driver_root_radius, half_1 - self.driver_dedendum),
            driven_root=_given(self.driven_root_radius, half_2 + self.driven_dedendum),
            thickness=self.thickness,
            crescent_extension=self.crescent_extension,
            suction_share=self.suction_share,
        )

    @property
    def phase_at_zero(self) -> Any:
        """nu_d [rad] at shaft angle 0, in [0, pitch)."""
        return within(self.start_phase, 2 * pi / self.driver_teeth)

    @model_validator(mode="after")
    def _teeth_mesh(self) -> Self:
        for holds, reason in _demands(self.chambers):
            if not holds:
                raise ValueError(f"{reason} with {self._named_geometry()}; change one of these")
        if self.volumes == "instantaneous":
            self._check_means()
        return self

    def _named_geometry(self) -> str:
        chambers = self.chambers
        lengths = {
            "module": self.module, "eccentricity": self.eccentricity,
            "driver_tip_radius": chambers.mesh.driver_tip, "driven_tip_radius": chambers.mesh.driven_tip,
            "driver_root_radius": chambers.driver_root, "driven_root_radius": chambers.driven_root,
        }  # fmt: skip
        words = [f"driver_teeth {self.driver_teeth}", f"driven_teeth {self.driven_teeth}"]
        words += [f"pressure_angle {self.pressure_angle * 180 / pi:.5g} deg"]
        return ", ".join(words + [f"{name} {1e3 * value:.5g} mm" for name, value in lengths.items()])

    def _check_means(self) -> None:
        """The volumes must stay positive; both are smallest just before or after a jump."""
        now = self.chambers
        jumps = [now.driver_opens, now.driven_opens, now.driver_closes, now.driven_closes, now.mesh.duration]
        edges = [0.0, *jumps, *(a - JUST_BEFORE for a in [*jumps, now.mesh.pitch])]
        angles = [angle for angle in edges if angle >= 0]
        dips = {
            "delivery_volume_mean": -min(now.delivery_change(a) for a in angles),
            "suction_volume_mean": -min(now.suction_change(a, now.exists(a)) for a in angles),
        }
        for name, dip in dips.items():
            if getattr(self, name) <= dip:
                raise ValueError(
                    f"{name} must exceed {1e6 * dip:.4g} cm^3, for the volume falls below its mean by that"
                )


def _given(value: Any, default: Any) -> Any:
    return default if value is None else value


def _demands(chambers: Chambers) -> Iterator[tuple[bool, str]]:
    """What continuous meshing needs and what is wrong otherwise; each can be evaluated once those before hold."""
    mesh = chambers.mesh
    z_1, z_2, theta_0 = mesh.driver_teeth, mesh.driven_teeth, mesh.pressure_angle
    rho_1, rho_2, R_t1, R_t2 = mesh.driver_base, mesh.driven_base, mesh.driver_tip, mesh.driven_tip
    R_f1, R_f2 = chambers.driver_root, chambers.driven_root
    yield z_2 > z_1, "the driven gear does not have more teeth than the driver"
    yield rho_2 - rho_1 <= mesh.eccentricity, "the eccentricity is below the difference of the base radii"
    yield R_f1 > 0, "the driver has no root circle"
    yield R_t1 > max(rho_1, R_f1), "the driver's tip lies within its base or root circle"
    yield rho_2 < R_t2 < R_f2, "the driven gear's tip does not lie between its base and root circles"
    yield external_thickness(R_t1, z_1, rho_1, theta_0) > 0, "the driver's teeth come to a point"
    yield half_angle(rho_1, z_1, rho_1, theta_0) < pi / z_1, "the driver's teeth leave no space between them"
    yield half_angle(R_f2, z_2, rho_2, theta_0) > 0, "the driven gear's tooth spaces come to a point"
    yield mesh.nu_01 >= 0, "the contact reaches below the driver's base circle"
    ratio = f"contact ratio {mesh.contact_ratio:.3g}"
    yield mesh.duration > 0, f"the teeth do not mesh continuously ({ratio}, not above 1)"
    yield mesh.duration < mesh.pitch, f"two volumes are trapped at once ({ratio}, not below 2)"
    yield chambers.trapped_at_start > 0, "the teeth overlap where the trapped volume begins"
    yield chambers.trapped_at_end > 0, "the teeth overlap where the trapped volume ends"
