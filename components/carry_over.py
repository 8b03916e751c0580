"""Carry-over volumes that one gear moves along the crescent, with the leakage over its tooth tips. No meshing here."""

from typing import Self

from pydantic import Field, model_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import (
    dissipates,
    gives_pressure,
    gives_signal,
    held,
    observable,
    reads_rotation,
    state,
    stores,
    stores_energy,
    supplies,
    takes_pressure,
    takes_signal,
)
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, event_where, ones, stack, total, when
from crescentlab.units import Angle, Flow, Length, Pressure, Ratio, Volume

from .flow_laws import drag_flow, slot_flow
from .meshing import within

ROUNDING = 1e-9
"""Rounding errors allowed in counts of pitches."""


class CarryOverChain(Component):
    r"""Carry-over volumes between suction and delivery, separated by tooth tips at the crescent.

    .. math:: \frac{dp_j}{dt} = \frac{\beta}{V} \frac{\rho_0}{\rho} (q_{j+1} - q_j + q_{chain,j}), \quad
              q_j = \frac{\rho_j}{\rho_0} \left(\frac{H h^3 (p_j - p_{j-1})}{12 \mu l}
              - \frac{h H R \tau \omega}{2}\right)

    p_j [Pa, gauge] pressure of volume j = 1 ... N from the suction side, p_0 the suction's, p_{N+1} the delivery's;
    V [m^3] each volume; q_j [m^3/s] flow through tip gap j = 1 ... N+1, positive towards suction, the drag of the tip
    always towards delivery; H [m] thickness, h [m] gap height, l [m] gap length, R [m] tip radius; tau [-] speed of
    the gear over that of the shaft, omega [rad/s] the shaft's speed; \mu [Pa s], \rho_j at the gap's mean pressure;
    q_chain [m^3/s] into volume j from what is attached to it. Once per `pitch` of the signal `phase` a new volume
    closes at the suction side with the suction's pressure and the others move up one place. A volume
    closes as the tip behind it comes to the crescent, one pitch after the tip before it did, and opens to delivery as
    that one leaves: `extension` less one pitch after it closed. Then tip gap N+1 is gone, the volume takes the
    delivery's pressure, and what flows into it passes on to delivery. N is the whole part of extension/pitch: N volumes
    are carried for the first extension - N pitch of each pitch, N - 1 for the rest of it. With N = 0 a single gap lies
    between delivery and suction at all times: an `extension` below one pitch seals for a part of each pitch only, and
    the short circuit of the rest is not modelled, so there the leakage is too small.

    Stored: the sum of V \rho/\rho_0 [m^3] over the volumes that exist, energy V e(p) [J]. The tips' drag supplies
    \rho_j [w(p_j) - w(p_{j-1})] h H R \tau \omega/2 [W] per gap, the pressure's share of the work of moving them, which
    is not asked of the shaft; the flow of pressure through the gaps is lost.

    Not for a reversed shaft, nor for a volume that changes while it is carried. Mixing with the delivery when a volume
    opens is left out (its pressure does not change the delivery's).
    Source: Rundo & Corvaglia (2016), Eqs. 1, 2, 24, 25 and section 2.1.
    """

    volumes: int = Field(default=1, ge=0, description="largest number of volumes N, whole part of extension/pitch")
    volume: Volume = Field(gt=0, description="each volume, a tooth space")
    pitch: Angle = Field(gt=0, description="shaft angle from one closing to the next")
    extension: Angle = Field(gt=0, description="shaft angle that a tooth spends at the crescent")
    gap_height: Length = Field(ge=0, description="clearance between tooth tip and crescent")
    gap_length: Length = Field(gt=0, description="thickness of the tooth tip, along the flow")
    thickness: Length = Field(gt=0, description="axial thickness of the gear")
    tip_radius: Length = Field(gt=0, description="tip radius of the gear")
    speed_ratio: Ratio = Field(default=1.0, gt=0, description="speed of the gear over that of the shaft")

    suction = takes_pressure("suction volume")
    delivery = takes_pressure("delivery volume")
    chain = gives_pressure("the volumes, from the suction side", size="volumes")
    shaft = reads_rotation("driver's shaft")
    phase = takes_signal(Angle, "shaft angle that passes whole pitches when a volume closes")
    exists = gives_signal(Ratio, "1 for each volume that exists, else 0", size="volumes")

    p = state(Pressure, "pressures of the volumes while they exist", start=0.0, nominal=1e5, size="volumes")
    closed_at = held(Angle, "phase at which the first volume closed", start=0.0, counts=True)
    started = held(Ratio, "1 once closed_at belongs to the phase", start=0.0)

    q_tip = observable(Flow, "flow out of delivery over the last tip at the crescent, positive towards suction")
    q_gaps = observable(
        Flow, "flows over the tips from the suction side, positive towards suction", size=lambda c: c.volumes + 1
    )
    content = stores()
    stored_energy = stores_energy("energy of the fluid in the volumes that exist")
    loss = dissipates("power lost by leakage over the tips")
    supply = supplies("work of the tips' drag against the pressure")

    def equations(
        self, p: Expr, q_chain: Expr, p_suction: Expr, p_delivery: Expr, omega_shaft: Expr, phase: Expr,
        closed_at: Expr, started: Expr, fluid: Fluid,
    ) -> Equations:  # fmt: skip
        """Flows over the tips, rates of pressure, and the shift of the chain."""
        N, turned = self.volumes, phase - closed_at
        sealed = event_where(turned < self.extension - N * self.pitch, 1.0, 0.0) if N else 1.0
        exists = stack(ones(N), sealed)[1:]  # all but the last always do
        p_now = exists * p + (1 - exists) * p_delivery
        along = stack(p_suction, p_now, p_delivery)
        leak = slot_flow(along[1:], along[:-1], self.thickness, self.gap_height, self.gap_length, fluid)
        tip_speed = self.tip_radius * self.speed_ratio * omega_shaft
        drag = drag_flow(along[1:], along[:-1], tip_speed, self.thickness, self.gap_height, fluid)
        gaps = stack(ones(N), sealed)
        q = gaps * (leak - drag)
        rise = fluid.rho_0 * gaps * (fluid.enthalpy(along[1:]) - fluid.enthalpy(along[:-1]))
        inflow = q[1:] - q[:-1] + q_chain
        passed_on = total((1 - exists) * inflow)
        return {
            "p_chain": p_now,
            "q_suction": -q[0],
            "q_delivery": q[N] - passed_on,
            "der_p": exists * fluid.bulk_modulus(p) / self.volume * fluid.rho_0 / fluid.density(p) * inflow,
            "exists": exists,
            "q_gaps": q,
            "q_tip": q[N] + total((1 - exists) * q[:-1]),
            "content": total(exists * self.volume * fluid.density(p) / fluid.rho_0),
            "stored_energy": total(exists * self.volume * fluid.energy_density(p)),
            "loss": total(rise * leak),
            "supply": total(rise * drag),
            "begins": when(started == 0, closed_at=phase - within(phase, self.pitch), started=1.0),
            "closes": when(
                (started == 1) & (turned >= self.pitch),
                p=stack(p_suction, p_now)[:-1], closed_at=closed_at + self.pitch,
            ),
        }  # fmt: skip

    @model_validator(mode="after")
    def _volumes_fit(self) -> Self:
        contacts = self.extension / self.pitch
        if not self.volumes - ROUNDING <= contacts <= self.volumes + 1 + ROUNDING:
            raise ValueError(
                f"volumes is {self.volumes}, but extension/pitch is {contacts:.4g}: a volume opens extension less one "
                f"pitch after it closed; write volumes: {int(contacts)}, or change extension or pitch"
            )
        return self
