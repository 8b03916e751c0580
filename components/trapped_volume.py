"""The volume trapped between two contact points of meshing gears. Its geometry comes from the gears."""

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    gives_pressure,
    observable,
    state,
    stores,
    stores_energy,
    takes_chamber,
    takes_pressure,
    takes_signal,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, when, where
from crescentlab.units import Pressure, Ratio


class TrappedVolume(Component):
    r"""Volume between two contact points of meshing gears; exists only for part of a pitch.

    .. math:: \frac{dp}{dt} = \frac{\beta}{V} \left(\frac{\rho_0}{\rho} \sum q - \frac{dV}{dt}\right)
              \text{ while it exists, else } p = p_d

    p [Pa, gauge]; p_d [Pa] delivery pressure; V [m^3], dV/dt [m^3/s] from the gears; q [m^3/s] into the volume; \beta
    [Pa], \rho [kg/m^3] at p. It appears with the delivery's pressure; while it does not exist it is a part of delivery
    and what flows into it passes on. Its peaks of pressure follow from the literal gaps of the meshing zone and are not
    trustworthy; not for cavitation. When it ends its content joins the suction's. Stored while it exists: V \rho/\rho_0
    [m^3], energy V e(p) [J]. Source: Rundo & Corvaglia (2016), Eq. 2 and section 2.1.
    """

    port = gives_pressure("the volume")
    delivery = takes_pressure("delivery volume")
    chamber = takes_chamber("its geometry")
    exists = takes_signal(Ratio, "1 while it exists, else 0")

    p_own = state(Pressure, "pressure while it exists", start=0.0, nominal=1e5)

    p = observable(Pressure, "pressure; the delivery's while it does not exist")
    content = stores()
    stored_energy = stores_energy()

    def equations(
        self, p_own: Expr, q_port: Expr, p_delivery: Expr, V_chamber: Expr, dV_chamber: Expr, exists: Expr, fluid: Fluid
    ) -> Equations:
        """Rate of pressure while the volume exists; otherwise its flows belong to delivery."""
        alive = exists > 0.5
        p_now = where(alive, p_own, p_delivery)
        inflow = fluid.rho_0 / fluid.density(p_own) * q_port - dV_chamber
        return {
            "p_port": p_now,
            "p_chamber": p_now,
            "p": p_now,
            "q_delivery": where(alive, 0.0, -q_port),
            "der_p_own": where(alive, fluid.bulk_modulus(p_own) / V_chamber * inflow, 0.0),
            "content": where(alive, V_chamber * fluid.density(p_own) / fluid.rho_0, 0.0),
            "stored_energy": where(alive, V_chamber * fluid.energy_density(p_own), 0.0),
            "appears": when(alive, p_own=p_delivery),
        }
