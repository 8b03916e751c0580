"""Gears of an external gear machine: the volumes they shape, their torque and phases. No leakage, no pressures."""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_chamber, gives_signal, held, observable, takes_rotation
from crescentlab.maths import Expr, event_where, pi, sin, sqrt, when
from crescentlab.units import Angle, Displacement, Length, Ratio, Torque, Volume

from .involute import base_radius, external_space_area
from .meshing import within


class ExternalGears(Component):
    r"""Two equal external gears in a housing: shape the delivery and the suction volume of a gear pump.

    .. math:: \frac{dV_d}{d\varphi} = -\frac{dV_s}{d\varphi} = -b \left(r_a^2 - r_w^2 - u^2\right), \quad
              u = r_b \left(\nu - \frac{\pi}{z}\right), \quad
              M = (p_d - p_s)\, b \left(r_a^2 - r_w^2 - u^2\right)

    V [m^3] of delivery and suction; \varphi [rad] of the driver's shaft; u [m] distance of the contact from the pitch
    point along the line of action; \nu [rad] runs from 0 to the pitch 2\pi/z, z = `teeth`; M [N m] torque of the shaft
    on the gears, positive while pumping; p [Pa, gauge]; b = `thickness` [m]; r_w = m z/2, r_b = r_w cos(\theta_0) [m]
    pitch and base radius, m = `module` [m], \theta_0 = `pressure_angle` [rad]; r_a = r_w + `addendum` [m]. Displacement
    2 \pi b (r_a^2 - r_w^2 - p_b^2/12), p_b = \pi m cos(\theta_0) [m]. Relief grooves part delivery and suction where
    the next pair's contact lies as far before the pitch point as this one's behind it, so nothing is trapped: there V_d
    jumps by what the teeth take back to suction. Tooth spaces are carried past the housing, from `seal_begins` over
    `extension` (angles of a tooth's centre from the line of centres, the same on both gears): V_s jumps by a space
    where one closes, V_d where one opens, half a pitch apart on the two gears. `driver_phase` and `driven_phase` pass
    through a whole number of pitches when a space of that gear closes, for two `carry_over_chain` of `space` [m^3]
    volumes.

    The shaft's power is all given to the chambers: none is lost or stored.

    Not for gears of different size, profile shift, a reversed shaft, or gears without relief grooves. Source: J.
    Ivantysyn, M. Ivantysynova, Hydrostatic Pumps and Motors (2001), external gear machines; N. D. Manring,
    S. B. Kasaragadda, J. Dyn. Syst. Meas. Control 125 (2003) 396-404, the theoretical flow ripple.
    """

    lossless: ClassVar[bool] = True

    teeth: int = Field(default=12, ge=6, description="teeth of each gear, z")
    module: Length = Field(gt=0, description="module")
    pressure_angle: Angle = Field(default=20 * pi / 180, gt=0, lt=pi / 2, description="pressure angle")
    thickness: Length = Field(gt=0, description="axial thickness of the gears")
    addendum: Length = Field(gt=0, description="height of a tooth above the pitch circle, mostly one module")
    dedendum: Length = Field(gt=0, description="depth of a tooth below the pitch circle, mostly 1.25 modules")
    seal_begins: Angle = Field(default=70 * pi / 180, gt=0, description="from the line of centres, suction side")
    extension: Angle = Field(default=220 * pi / 180, gt=0, description="angle over which the housing seals")
    delivery_volume: Volume = Field(gt=0, description="mean volume of the delivery side, ducts included")
    suction_volume: Volume = Field(gt=0, description="mean volume of the suction side, ducts included")

    shaft = takes_rotation("driver's shaft")
    delivery = gives_chamber("delivery volume")
    suction = gives_chamber("suction volume")
    driver_phase = gives_signal(Angle, "shaft angle since a space of the driver closed, plus whole pitches")
    driven_phase = gives_signal(Angle, "shaft angle since a space of the driven gear closed, plus whole pitches")

    mesh_start = held(Angle, "shaft angle at which the running pitch began", start=0.0, counts=True)
    started = held(Ratio, "1 once mesh_start belongs to the shaft's angle", start=0.0)

    dVd = observable(Displacement, "delivery volume per shaft angle")
    torque = observable(Torque, "torque of the shaft on the gears, positive while pumping")
    displacement = observable(Displacement, "mean volume displaced per shaft angle")
    space = observable(Volume, "volume of a tooth space")

    def equations(
        self, phi_shaft: Expr, omega_shaft: Expr, mesh_start: Expr, started: Expr, p_delivery: Expr, p_suction: Expr
    ) -> Equations:
        """Rates, volumes, torque and phases at the shaft's angle."""
        pitch, space = self.pitch, self.space_volume
        nu = phi_shaft - mesh_start
        rate = -self.thickness * (self._sweep - (self._base * (nu - pitch / 2)) ** 2)
        torque = (p_suction - p_delivery) * rate
        swept = self._swept(nu) - self.displaced / 2
        joins, leaves = self._spaces(nu, *self.opens), self._spaces(nu, *self.closes)
        first, second = self.closes
        return {
            "V_delivery": self.delivery_volume - swept + space * joins,
            "dV_delivery": rate * omega_shaft,
            "V_suction": self.suction_volume + swept - space * leaves,
            "dV_suction": -rate * omega_shaft,
            "driver_phase": phi_shaft + within(-first, pitch),
            "driven_phase": phi_shaft + within(-second, pitch),
            "torque_shaft": torque,
            "torque": torque,
            "dVd": rate,
            "displacement": self.displaced / pitch,
            "space": space,
            "begins": when(started == 0, mesh_start=phi_shaft - within(phi_shaft, pitch), started=1.0),
            "meshes": when((started == 1) & (nu >= pitch), mesh_start=mesh_start + pitch),
        }

    @property
    def pitch(self) -> float:
        """Angular pitch [rad]."""
        return 2 * pi / self.teeth

    @property
    def closes(self) -> tuple[Any, Any]:
        """nu [rad] at which a tooth of driver and driven gear reaches the seal: it is 3/4 and 1/4 pitch behind nu."""
        begins, pitch = self.seal_begins, self.pitch
        return within(begins + 0.75 * pitch, pitch), within(begins + 0.25 * pitch, pitch)

    @property
    def opens(self) -> tuple[Any, Any]:
        """nu [rad] at which a tooth space of driver and driven gear meets the delivery."""
        first, second = self.closes
        return within(first + self.extension, self.pitch), within(second + self.extension, self.pitch)

    @property
    def displaced(self) -> Any:
        """Volume [m^3] displaced in a pitch by both gears."""
        return self._swept(self.pitch)

    @property
    def space_volume(self) -> Any:
        """Volume [m^3] of a tooth space."""
        pitch_radius = self._pitch_radius
        area = external_space_area(
            pitch_radius - self.dedendum, pitch_radius + self.addendum, self.teeth, self._base, self.pressure_angle
        )
        return self.thickness * area

    @property
    def contact_ratio(self) -> Any:
        """Length of the line of action between the tip circles, over the base pitch [-]."""
        tip = self._pitch_radius + self.addendum
        half = sqrt(tip * tip - self._base * self._base) - self._pitch_radius * sin(self.pressure_angle)
        return 2 * half / (self._base * self.pitch)

    @property
    def _pitch_radius(self) -> Any:
        return self.module * self.teeth / 2

    @property
    def _base(self) -> Any:
        return base_radius(self.teeth, self.module, self.pressure_angle)

    @property
    def _sweep(self) -> Any:
        """r_a^2 - r_w^2 [m^2]."""
        tip = self._pitch_radius + self.addendum
        return tip * tip - self._pitch_radius * self._pitch_radius

    def _swept(self, nu: Any) -> Any:
        """Volume [m^3] displaced from nu = 0."""
        half = self.pitch / 2
        return self.thickness * (self._sweep * nu - self._base**2 * ((nu - half) ** 3 + half**3) / 3)

    def _spaces(self, nu: Any, first: Any, second: Any) -> Any:
        """Tooth spaces that came or went since nu = 0, less their mean over a pitch."""
        passed = event_where(nu >= first, 1.0, 0.0) + event_where(nu >= second, 1.0, 0.0)
        return passed - (2 - (first + second) / self.pitch)

    @model_validator(mode="after")
    def _gears_mesh(self) -> Self:
        degrees = 180 / pi
        if self._pitch_radius <= self.dedendum:
            raise ValueError("the gears have no root circle; dedendum must be below module * teeth / 2")
        if not self.contact_ratio >= 1:
            raise ValueError(
                f"the teeth do not mesh continuously (contact ratio {self.contact_ratio:.3g}, below 1); "
                "raise addendum or teeth, or lower pressure_angle"
            )
        if 2 * self.space_volume <= self.displaced:
            raise ValueError("two tooth spaces hold less than a pitch displaces; raise dedendum or lower addendum")
        if self.seal_begins + self.extension >= 2 * pi:
            raise ValueError(
                f"the seal ends {(self.seal_begins + self.extension) * degrees:.4g} deg from the line of centres, "
                "beyond a turn; lower seal_begins or extension"
            )
        least = self.displaced + 2 * self.space_volume
        for name in ("delivery_volume", "suction_volume"):
            if getattr(self, name) <= least:
                raise ValueError(f"{name} must exceed {1e6 * least:.4g} cm^3, by which it may fall below its mean")
        return self
