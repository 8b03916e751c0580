"""Contact of an internal involute pair: vector rays, swept areas, contact ratio, phases. No forms of teeth here.

Symbols and equation numbers are those of Rundo & Corvaglia (2016). Angles are turned by the driver's shaft [rad]
unless said otherwise; a contact point is named by its roll angle y [rad] on the driver, y = nu_d + nu_01 for P1.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from crescentlab.maths import fmod, pi, sqrt, tan

from .involute import base_radius, half_angle, operating_angle


def within(angle: Any, period: Any) -> Any:
    """`angle` less whole periods, in [0, period). For constants and remaps, never for a running angle."""
    return fmod(fmod(angle, period) + period, period)


def integral(rate: Callable[[Any], Any], start: Any, end: Any) -> Any:
    """Integral of a polynomial of degree 3 or less: Simpson's rule, which is exact for it."""
    return (end - start) / 6 * (rate(start) + 4 * rate((start + end) / 2) + rate(end))


@dataclass(frozen=True)
class Meshing:
    r"""An external driver of z_1 teeth inside a driven gear of z_2 teeth; lengths in [m], angles in [rad].

    .. math:: \nu_{01} = \frac{\sqrt{R_{t2}^2 - \rho_2^2} - \rho_2 (1-\tau) \tan\theta}{\rho_1}, \quad
              \nu_{02} = \frac{\sqrt{R_{t1}^2 - \rho_1^2}}{\rho_1} - \Delta\varphi, \quad
              \tau = \frac{z_1}{z_2} = \frac{\rho_1}{\rho_2}, \quad \Delta\varphi = \frac{2\pi}{z_1}

    Holds where 1 < contact ratio < 2 and nu_01 >= 0. Source: Rundo & Corvaglia (2016), Eqs. 3-16.
    """

    driver_teeth: int
    driven_teeth: int
    module: Any
    pressure_angle: Any
    eccentricity: Any
    driver_tip: Any
    driven_tip: Any

    @property
    def ratio(self) -> float:
        """tau [-], speed of the driven gear over that of the driver."""
        return self.driver_teeth / self.driven_teeth

    @property
    def pitch(self) -> float:
        """Delta phi [rad], angular pitch of the driver."""
        return 2 * pi / self.driver_teeth

    @cached_property
    def driver_base(self) -> Any:
        """rho_1 [m]."""
        return base_radius(self.driver_teeth, self.module, self.pressure_angle)

    @cached_property
    def driven_base(self) -> Any:
        """rho_2 [m]."""
        return base_radius(self.driven_teeth, self.module, self.pressure_angle)

    @cached_property
    def angle(self) -> Any:
        """theta [rad], operating pressure angle."""
        return operating_angle(self.driver_base, self.driven_base, self.eccentricity)

    @cached_property
    def nu_01(self) -> Any:
        """Roll angle [rad] where contact begins, Eqs. 7 and 8."""
        rho_1, rho_2, R_t2 = self.driver_base, self.driven_base, self.driven_tip
        return (sqrt(R_t2 * R_t2 - rho_2 * rho_2) - rho_2 * self._offset) / rho_1

    @cached_property
    def nu_02(self) -> Any:
        """Roll angle [rad] where contact ends, less one pitch, Eqs. 10 and 11."""
        rho_1, R_t1 = self.driver_base, self.driver_tip
        return sqrt(R_t1 * R_t1 - rho_1 * rho_1) / rho_1 - self.pitch

    @cached_property
    def duration(self) -> Any:
        """Angle [rad] for which the trapped volume exists: nu_s reaches the pitch in Eq. 12."""
        return self.nu_02 - self.nu_01

    @cached_property
    def contact_ratio(self) -> Any:
        """Mean number [-] of pairs of teeth in contact."""
        return 1 + self.duration / self.pitch

    @cached_property
    def _offset(self) -> Any:
        """Roll angle [rad] on the driven gear where the driver's is 0."""
        return (1 - self.ratio) * tan(self.angle)

    def driven_roll(self, y: Any) -> Any:
        """Roll angle [rad] on the driven gear of the contact at y."""
        return self.ratio * y + self._offset

    def driver_ray_squared(self, y: Any) -> Any:
        """rho_i^2 [m^2], the vector ray from the driver's centre to the contact at y, Eqs. 13 and 15."""
        return self.driver_base * self.driver_base * (1 + y * y)

    def driven_ray_squared(self, y: Any) -> Any:
        """rho_o^2 [m^2], the vector ray from the driven gear's centre to the contact at y, Eqs. 14 and 16."""
        roll = self.driven_roll(y)
        return self.driven_base * self.driven_base * (1 + roll * roll)

    def delivery_rate(self, y: Any) -> Any:
        """Area [m^2/rad] the delivery gains with its contact at y, Eq. 3 over H; the suction loses it, Eq. 4."""
        driver = self.driver_ray_squared(y) - self.driver_tip * self.driver_tip
        driven = self.driven_tip * self.driven_tip - self.driven_ray_squared(y)
        return (driver + self.ratio * driven) / 2

    def trapped_rate(self, y: Any) -> Any:
        """Area [m^2/rad] that the trapped volume gains with P1 at y and P2 one pitch ahead, Eq. 5 over H."""
        return self.delivery_rate(y + self.pitch) - self.delivery_rate(y)

    def delivery_gain(self, nu: Any) -> Any:
        """Area [m^2] that the delivery gains from nu_d = 0 to nu; negative, it is what the gears displace."""
        return integral(self.delivery_rate, self.nu_01, self.nu_01 + nu)

    def trapped_gain(self, nu: Any) -> Any:
        """Area [m^2] that the trapped volume gains from nu_d = 0 to nu."""
        return integral(self.trapped_rate, self.nu_01, self.nu_01 + nu)

    @cached_property
    def driver_tooth(self) -> Any:
        r"""Angle [rad] from the line of centres to the driver's tooth centre at nu_d = 0.

        .. math:: g_0 = \nu_{01} - \theta - \left(\frac{\pi}{2 z_1} + \mathrm{inv}\,\theta_0\right)
        """
        return self.nu_01 - self.angle - self._half_angle_at_base(self.driver_teeth, self.driver_base)

    @cached_property
    def driven_tooth(self) -> Any:
        r"""Angle [rad, of the driven gear] from the line of centres to its tooth centre at nu_d = 0.

        .. math:: \tau \nu_{01} + (1-\tau) \tan\theta - \theta
                  - \left(\frac{\pi}{2 z_2} + \mathrm{inv}\,\theta_0\right) + \frac{\pi}{z_2}

        At the nominal centre distance (theta = theta_0) it is tau g_0 + pi/z_2.
        """
        half_space = self._half_angle_at_base(self.driven_teeth, self.driven_base)
        return self.driven_roll(self.nu_01) - self.angle - half_space + pi / self.driven_teeth

    def _half_angle_at_base(self, teeth: int, base: Any) -> Any:
        return half_angle(base, teeth, base, self.pressure_angle)

    def driver_tooth_at(self, angle: Any) -> Any:
        """nu_d in [0, pitch) at which a driver tooth's centre line passes `angle` [rad] from the line of centres."""
        return within(angle - self.driver_tooth, self.pitch)

    def driven_tooth_at(self, angle: Any) -> Any:
        """nu_d in [0, pitch) at which a driven tooth's centre line passes `angle` [rad, of the driven gear]."""
        return within((angle - self.driven_tooth) / self.ratio, self.pitch)
