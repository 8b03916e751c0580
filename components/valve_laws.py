"""Laws that valves share: edges that open, jets, and how a moving part follows what drives it. No components here.

All work on floats and symbols, in SI; every Jacobian is finite, also where a valve starts to open.
"""

from dataclasses import dataclass
from typing import Any, Literal

from pydantic import BaseModel, Field

from crescentlab.fluid import Fluid
from crescentlab.maths import cos, hypot, maximum, minimum, not_, pi, sqrt, when, where
from crescentlab.units import Angle, Area, Length, Pressure, Ratio

from .flow_laws import DIAMETER_ROUNDING, hydraulic_diameter_of, orifice_flow

Direction = Literal["up", "down"]
"""Whether an edge opens towards increasing x or decreasing x."""


class Metering(BaseModel):
    """What a valve that meters through one area is described by."""

    area: Area = Field(ge=0, description="flow area when fully open")
    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    diameter_rounding: Length = Field(default=DIAMETER_ROUNDING, gt=0, description="rounding of the diameter at 0 area")

    def metered(self, p_a: Any, p_b: Any, share: Any, fluid: Fluid) -> Any:
        """Flow [m^3/s] from a to b through `share` [-] of the area, counted within 0 and 1."""
        return self.through(p_a, p_b, self.area * clipped(share), fluid)

    def through(self, p_a: Any, p_b: Any, area: Any, fluid: Fluid) -> Any:
        """Flow [m^3/s] from a to b through an area [m^2] of the same kind of edge."""
        d_h = hydraulic_diameter_of(area, self.diameter_rounding)
        return orifice_flow(p_a, p_b, area, d_h, self.cd_max, self.lambda_c, fluid)


class Jet(BaseModel):
    """What the jet at a moving edge is described by."""

    cd_max: Ratio = Field(default=0.7, gt=0, le=1, description="largest discharge coefficient")
    lambda_c: Ratio = Field(default=100.0, gt=0, description="critical flow number")
    jet_coefficient: Ratio = Field(default=1.0, description="correction of the flow force; 0: none, below 0: it opens")
    edge_rounding: Length = Field(default=1e-6, gt=0, description="opening over which the area begins to grow")
    drop_rounding: Pressure = Field(default=100.0, gt=0, description="rounding of the jet's velocity at zero drop")

    def jet(self, p_a: Any, p_b: Any, area: Any, hydraulic_diameter: Any, cosine: Any, fluid: Fluid) -> "Issue":
        r"""What passes an edge, and the momentum of the jet along the axis.

        .. math:: \rho_0 q = \rho\, C_d A v_{jet}, \quad F = k \rho_0 |q| v_{jet} \cos\vartheta, \quad
                  v_{jet} = \sqrt{2|\Delta p|/\rho}

        \rho_0 q [kg/s] the mass flow; A = `area` [m^2]; `cosine` = cos \vartheta [-] of the jet's angle to the axis; k
        = `jet_coefficient` [-].
        """
        through_unit = orifice_flow(p_a, p_b, 1.0, hydraulic_diameter, self.cd_max, self.lambda_c, fluid)
        q, rounded = area * through_unit, hypot(p_a - p_b, self.drop_rounding)
        jet_velocity = (p_a - p_b) * sqrt(2 / (fluid.density((p_a + p_b) / 2) * rounded))
        force = self.jet_coefficient * fluid.rho_0 * q * jet_velocity * cosine
        return Issue(q, force, fluid.rho_0 * through_unit)


@dataclass(frozen=True)
class Issue:
    """What passes an edge."""

    q: Any
    """Flow from a to b [m^3/s]."""
    force: Any
    """Flow force towards closing [N]."""
    mass_flux: Any
    """Mass flow per uncovered area [kg/(s m^2)], of the sign of q."""


@dataclass(frozen=True)
class Uncovered:
    """What the edge of a spool has uncovered."""

    area: Any
    """[m^2]."""
    slope: Any
    """Of the area over the travel [m]."""
    hydraulic_diameter: Any
    """4 area/perimeter [m]."""


class SpoolEdge(Jet):
    """What the edge of a spool is described by, besides the shape of what it uncovers."""

    opens: Direction = Field(default="up", description="where it opens: up is towards increasing x")
    overlap: Length = Field(default=0.0, description="travel from x = 0 until the edge starts to open")
    jet_angle: Angle = Field(
        default=69 * pi / 180, ge=0, le=pi / 2,
        description="angle of the jet to the spool's axis: 69 deg for sharp edges (von Mises)",
    )  # fmt: skip
    damping_length: Length = Field(
        default=0.0, description="from the edge to the other port, counted into side a; below 0 into side b"
    )

    @property
    def towards(self) -> float:
        """1 for an edge that opens towards increasing x, -1 for the other."""
        return 1.0 if self.opens == "up" else -1.0

    def travel(self, x_rod: Any) -> Any:
        """Travel [m] from where the edge starts to open."""
        return self.towards * x_rod - self.overlap

    def issued(self, uncovered: Uncovered, p_a: Any, p_b: Any, v_rod: Any, fluid: Fluid) -> dict[str, Any]:
        r"""What every edge returns, from what it has uncovered.

        .. math:: F_t = L \rho_0 \frac{q}{A} \frac{dA}{dx} v

        F_t [N] the transient flow force; \rho_0 q [kg/s] the mass flow; L = `damping_length` [m]; v = `v_rod` [m/s];
        q/A goes on where A is 0.
        """
        issue = self.jet(p_a, p_b, uncovered.area, uncovered.hydraulic_diameter, cos(self.jet_angle), fluid)
        transient = self.damping_length * issue.mass_flux * uncovered.slope * v_rod
        return {
            "q_a": issue.q,
            "q_b": -issue.q,
            "f_rod": self.towards * issue.force + transient,
            "q": issue.q,
            "area": uncovered.area,
            "jet_force": issue.force,
            "transient_force": transient,
        }


def opening(travel: Any, rounding: Any) -> tuple[Any, Any]:
    r"""Opening [m] of an edge after `travel` [m] from where it starts, and its slope [-].

    .. math:: h = x \quad (x \ge w), \qquad h = w (2 s^2 - s^3), \quad s = x/w \quad (0 < x < w), \qquad
              h = 0 \quad (x \le 0)

    w = `rounding` [m]: the slope is continuous.
    """
    s = minimum(maximum(travel / rounding, 0.0), 1.0)
    return rounding * s * s * (2 - s) + maximum(travel - rounding, 0.0), s * (4 - 3 * s)


def limited(travel: Any, slope: Any, longest: Any) -> tuple[Any, Any]:
    """An opening and its slope that end at the `longest` [m]."""
    return minimum(travel, longest), where(travel < longest, slope, 0.0)


def edge_share(stroke: Any, overlap: Any, rounding: Any) -> Any:
    r"""Open share [-] of a valve's edge at a stroke [-] of -1 to 1.

    .. math:: s = \frac{y}{1 - u}, \quad y = x - u \ (x > u + w), \quad y = \frac{(x - u + w)^2}{4 w} \ (|x - u| \le w),
              \quad y = 0 \ (x < u - w)

    u = `overlap`, w = `rounding` > 0, both as shares of the stroke; s is 1 at full stroke, x = 1.
    """
    return _rounded(stroke - overlap, rounding) / (1 - overlap)


def middle_share(stroke: Any, closed: Any, rounding: Any) -> Any:
    r"""Open share [-] of an edge that is open in the middle of the stroke, x = 0, and closes to both sides.

    .. math:: s = \frac{c - |x|}{c - w/2} \quad (|x| < c), \qquad s = 0 \quad (|x| \ge c)

    c = `closed`; both corners, in the middle and at c, are rounded within w = `rounding` > 0 as in :func:`edge_share`,
    which takes w/2 off the peak: s is 1 in the middle. All as shares of the stroke.
    """
    away = _rounded(stroke, rounding) + _rounded(-stroke, rounding)
    return _rounded(closed - away, rounding) / _rounded(closed - rounding / 2, rounding)


def _rounded(y: Any, w: Any) -> Any:
    """The larger of y and 0, its corner replaced by (y + w)^2/(4 w) within w."""
    bend = clipped(y + w, 0.0, 2 * w)
    return bend * bend / (4 * w) + maximum(y - w, 0.0)


def clipped(value: Any, low: Any = 0.0, high: Any = 1.0) -> Any:
    """`value` within low and high."""
    return minimum(maximum(value, low), high)


def follower(
    position: Any, rate: Any, at: Any, target: Any, omega: Any, damping_ratio: Any, low: float
) -> dict[str, Any]:
    r"""Derivatives and events of the states `position` [-], `rate` [1/s], held `at`, of a driven moving part.

    .. math:: \frac{d^2 x}{dt^2} = \omega^2 (x_t - x) - 2 \zeta \omega \frac{dx}{dt}, \quad x_{low} \le x \le 1

    x_t = `target` [-], which may lie beyond the stops, where it pushes all the more; \omega [rad/s]; \zeta =
    `damping_ratio` [-]. At a stop it rests until the target leads away from it. at: -1 rests on the low stop, 1 on the
    high one, 0 free.
    """
    pull = omega * omega * (target - position) - 2 * damping_ratio * omega * rate
    free = at == 0
    return {
        "der_position": rate,
        "der_rate": where(free, pull, 0.0),
        "hits_low": when(free & (position < low), position=low, rate=0.0, at=-1.0),
        "hits_high": when(free & (position > 1.0), position=1.0, rate=0.0, at=1.0),
        "leaves": when((at == -1) & (target > low) | (at == 1) & (target < 1.0), at=0.0),
    }


def lagging(name: str, position: Any, at: Any, target: Any, time_constant: Any, low: Any = 0.0) -> dict[str, Any]:
    r"""Derivative and events of the state `name`, at `position` [-], of a driven moving part without mass.

    .. math:: T \frac{dx}{dt} = x_t - x, \quad x_{low} \le x \le 1

    x_t = `target` [-], which may lie beyond the stops, where it pushes all the more; T = `time_constant` [s]. At a stop
    it rests until the target leads away from it. at: -1 rests on the low stop, 1 on the high one, 0 free, -2 until the
    start is looked at, which is put between the stops. Hitting and leaving a stop look at one relation from both sides,
    so that no instant sees both.
    """
    free, above, below = at == 0, target > low, target < 1.0
    return {
        f"der_{name}": where(free, (target - position) / time_constant, 0.0),
        "starts": when(at == -2, **{name: clipped(position, low)}, at=0.0),
        "hits_low": when(free & (position < low) & not_(above), **{name: low}, at=-1.0),
        "hits_high": when(free & (position > 1.0) & not_(below), **{name: 1.0}, at=1.0),
        "leaves": when((at == -1) & above | (at == 1) & below, at=0.0),
    }
