"""Delivery, suction, trapped and carry-over volumes of a crescent pump over one pitch. No component here."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from crescentlab.maths import event_where, pi

from .involute import external_space_area, internal_space_area
from .meshing import Meshing, integral, within


@dataclass(frozen=True)
class Chambers:
    r"""Volumes [m^3] as functions of nu_d [rad], which runs from 0 to the pitch of the driver.

    .. math:: V_d = \int_0^{\nu_d} \frac{dV_d}{d\nu}\,d\nu + V_i [\nu_d \ge a_i] + V_o [\nu_d \ge a_o] + c_d, \quad
              V_t = V_{t0} + \int_0^{\nu_d} \frac{dV_t}{d\nu}\,d\nu, \quad
              V_s = c_s - (V_d)_{sw} - V_t [\nu_d < \nu_e] - V_i [\nu_d \ge s_i] - V_o [\nu_d \ge s_o]

    V_i, V_o [m^3] tooth spaces of driver and driven gear; a, s [rad] where the last carry-over volume opens to
    delivery and where a new one closes at the suction side; nu_e [rad] where the trapped volume ends; (V_d)_sw the
    integral in V_d; c_d, c_s [m^3] make the mean over a pitch zero, so these are changes from the mean. V_t0, what the
    tooth spaces bring less what a pitch displaces, makes V_d periodic, and then V_s is: together with the carry-over
    volumes the sum never changes. Source: Rundo & Corvaglia (2016), Eqs. 3-5 integrated, section 6.1.
    """

    mesh: Meshing
    driver_root: Any
    driven_root: Any
    thickness: Any
    crescent_extension: Any
    suction_share: Any

    @cached_property
    def driver_space(self) -> Any:
        """V_i [m^3]."""
        mesh = self.mesh
        return self.thickness * external_space_area(
            self.driver_root, mesh.driver_tip, mesh.driver_teeth, mesh.driver_base, mesh.pressure_angle
        )

    @cached_property
    def driven_space(self) -> Any:
        """V_o [m^3]."""
        mesh = self.mesh
        return self.thickness * internal_space_area(
            mesh.driven_tip, self.driven_root, mesh.driven_teeth, mesh.driven_base, mesh.pressure_angle
        )

    @cached_property
    def displaced(self) -> Any:
        """Volume [m^3] displaced to delivery in a pitch, Eq. 3."""
        return -self.thickness * self.mesh.delivery_gain(self.mesh.pitch)

    @cached_property
    def trapped_at_start(self) -> Any:
        """V_t0 [m^3]."""
        return self.driver_space + self.driven_space - self.displaced

    @cached_property
    def trapped_at_end(self) -> Any:
        """Trapped volume [m^3] when it joins the suction."""
        return self.trapped_running(self.mesh.duration)

    @cached_property
    def trapped_mean(self) -> Any:
        """Mean trapped volume [m^3] while it exists."""
        return integral(self.trapped_running, 0.0, self.mesh.duration) / self.mesh.duration

    def trapped_running(self, nu_d: Any) -> Any:
        """V_t [m^3] where it exists."""
        return self.trapped_at_start + self.thickness * self.mesh.trapped_gain(nu_d)

    @cached_property
    def suction_end(self) -> Any:
        """Psi_s [rad], the crescent's middle to its end at the suction side."""
        return self.suction_share * self.crescent_extension

    @cached_property
    def driver_closes(self) -> Any:
        """s_i [rad]."""
        return self.mesh.driver_tooth_at(pi - self.suction_end)

    @cached_property
    def driven_closes(self) -> Any:
        """s_o [rad]; on the driven gear the crescent is wider, Psi/tau."""
        return self.mesh.driven_tooth_at(pi - self.suction_end / self.mesh.ratio)

    @property
    def driver_extension(self) -> Any:
        """Shaft angle [rad] that a driver tooth spends at the crescent."""
        return self.crescent_extension

    @property
    def driven_extension(self) -> Any:
        """Shaft angle [rad] that a driven tooth spends at the crescent."""
        return self.crescent_extension / self.mesh.ratio**2

    @property
    def driver_contacts(self) -> Any:
        """Mean number [-] of driver teeth at the crescent; its whole part is N_i of Eq. 1."""
        return self.driver_extension / self.mesh.pitch

    @property
    def driven_contacts(self) -> Any:
        """Mean number [-] of driven teeth at the crescent; its whole part is N_o."""
        return self.driven_extension / self.mesh.pitch

    @cached_property
    def driver_opens(self) -> Any:
        """a_i [rad]."""
        return within(self.driver_closes + self.driver_extension, self.mesh.pitch)

    @cached_property
    def driven_opens(self) -> Any:
        """a_o [rad]."""
        return within(self.driven_closes + self.driven_extension, self.mesh.pitch)

    def exists(self, nu_d: Any) -> Any:
        """1 while the trapped volume exists, else 0."""
        return event_where(nu_d < self.mesh.duration, 1.0, 0.0)

    def trapped(self, nu_d: Any, exists: Any) -> Any:
        """V_t [m^3]; V_t0 while it does not exist, for the volume must stay positive."""
        return exists * self.trapped_running(nu_d) + (1 - exists) * self.trapped_at_start

    def delivery_change(self, nu_d: Any) -> Any:
        """V_d less its mean [m^3]."""
        joined = self._spaces_from(nu_d, self.driver_opens, self.driven_opens)
        mean = self._mean_swept + self._mean_spaces(self.driver_opens, self.driven_opens)
        return self._swept(nu_d) + joined - mean

    def suction_change(self, nu_d: Any, exists: Any) -> Any:
        """V_s less its mean [m^3], with the trapped volume existing (1) or not (0)."""
        left = self._spaces_from(nu_d, self.driver_closes, self.driven_closes)
        in_trapped = exists * self.trapped_running(nu_d)
        mean = self._mean_swept + self._mean_spaces(self.driver_closes, self.driven_closes)
        mean_in_trapped = self.trapped_mean * self.mesh.duration / self.mesh.pitch
        return mean + mean_in_trapped - self._swept(nu_d) - left - in_trapped

    def _swept(self, nu_d: Any) -> Any:
        return self.thickness * self.mesh.delivery_gain(nu_d)

    @cached_property
    def _mean_swept(self) -> Any:
        return integral(self._swept, 0.0, self.mesh.pitch) / self.mesh.pitch

    def _spaces_from(self, nu_d: Any, driver: Any, driven: Any) -> Any:
        """A tooth space [m^3] of each gear from its angle on."""
        return event_where(nu_d >= driver, self.driver_space, 0.0) + event_where(nu_d >= driven, self.driven_space, 0.0)

    def _mean_spaces(self, driver: Any, driven: Any) -> Any:
        pitch = self.mesh.pitch
        return self.driver_space * (1 - driver / pitch) + self.driven_space * (1 - driven / pitch)
