"""Play in a drive: two shafts that touch only beyond a dead zone."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, state, stores_energy, takes_rotation
from crescentlab.maths import Expr, event_where
from crescentlab.units import Angle, Ratio, RotaryStiffness, Speed, Torque

from .mechanics import contact_force


class Backlash(Component):
    r"""Play between two rotors: a pair of teeth, a claw coupling, a spline, elastic once the play is used up.

    .. math:: \frac{d\vartheta}{dt} = \omega_a - \omega_b, \quad
              T = c \delta (1 + \alpha \dot\delta) \text{ for } \delta = |\vartheta| - \frac{\beta}{2} > 0, \quad
              \alpha \omega_i - \ln(1 + \alpha \omega_i) = -e \alpha \omega_i - \ln(1 - e \alpha \omega_i)

    \vartheta [rad] angle of a less angle of b from the middle of the play, a state of its own, so that the rotors'
    angles may be counted on for ever; \beta = `play` [rad] from flank to flank; T [N m] on b towards its flank, the
    reaction on a, never pulling; c = `stiffness` [N m/rad]; e = `restitution` [-] at \omega_i = `impact_speed` [rad/s],
    below 0.01 counted as 0.01, and nearer to 1 in slower impacts. Touching and parting are events. It starts in the
    middle unless `start: {twist: ...}` says otherwise. Energy: c \delta^2/2 [J]; c \delta \alpha \dot\delta^2 [W] is
    lost, and all that is stored where flanks part faster than they expand. Not for the lag of a signal behind play, nor
    for friction that holds within it (`rotary_friction`). Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42
    (1975) 440-445, with the exponent 1, on both flanks.
    """

    play: Angle = Field(ge=0, description="angle that a turns against b from flank to flank")
    stiffness: RotaryStiffness = Field(gt=0, description="torque per angle beyond the play")
    restitution: Ratio = Field(default=0.5, ge=0, le=1, description="rebound over impact speed")
    impact_speed: Speed = Field(default=1.0, gt=0, description="relative speed at which the restitution holds")

    a = takes_rotation("driving rotor")
    b = takes_rotation("driven rotor")
    twist = state(Angle, "angle of a less angle of b, from the middle of the play", start=0.0, nominal=1e-3)
    torque = observable(Torque, "torque from a to b")
    stored_energy = stores_energy("strain energy of the flanks")
    loss = dissipates()

    def equations(self, twist: Expr, omega_a: Expr, omega_b: Expr) -> Equations:
        law = (self.stiffness, self.restitution, self.impact_speed)
        slip = omega_a - omega_b
        half = self.play / 2
        ahead = event_where(twist > half, twist - half, 0.0)
        behind = event_where(twist < -half, -half - twist, 0.0)
        torque = contact_force(ahead, slip, *law) - contact_force(behind, -slip, *law)
        return {
            "torque_a": torque,
            "torque_b": -torque,
            "der_twist": slip,
            "torque": torque,
            "stored_energy": self.stiffness * (ahead * ahead + behind * behind) / 2,
            "loss": (torque - self.stiffness * (ahead - behind)) * slip,
        }
