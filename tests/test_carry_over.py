"""Carry-over chains and the trapped volume: Eqs. 24 and 25 by hand, shifts, balances."""

import numpy as np
import pytest
from crescentlab.components.carry_over import CarryOverChain
from crescentlab.components.crescent_gears import CrescentGears
from crescentlab.components.trapped_volume import TrappedVolume
from pydantic import ValidationError

from crescentlab.contract import Case, check_energy
from crescentlab.fluid import Fluid
from crescentlab.maths import exp

DEG = np.pi / 180
PITCH = 2 * np.pi / 13
OMEGA = 2000 * np.pi / 30
BAR = 1e5


class Oil(Fluid):
    """860 kg/m3, 35 cSt at every pressure; beta 5000 bar for small changes."""

    def density(self, p):
        return 860.0 * exp(p / 5e8)

    def bulk_modulus(self, p):
        return 5e8 + 0.0 * p

    def kinematic_viscosity(self, p):
        return 0.0301 / self.density(p)


OIL = Oil()


def chain(volumes=1, extension=34 * DEG, **parameters):
    given = {"volume": 566.75e-9, "pitch": PITCH, "gap_height": 150e-6, "gap_length": 2.149e-3}
    given |= {"thickness": 13e-3, "tip_radius": 29.1e-3, **parameters}
    return CarryOverChain(volumes=volumes, extension=extension, **given)


def at(part, phase, p=(), p_suction=0.0, p_delivery=5 * BAR, q_chain=None, **more):
    given = {"omega_shaft": OMEGA, "closed_at": 0.0, "started": 1.0, **more}
    p = np.asarray(p, dtype=float)
    q = np.zeros(part.volumes) if q_chain is None else np.asarray(q_chain, dtype=float)
    return part.equations(p=p, q_chain=q, p_suction=p_suction, p_delivery=p_delivery, phase=phase, fluid=OIL, **given)


# Poiseuille H h^3/(12 mu l) with mu = 0.0301 Pa s: 13e-3 * (150e-6)^3 / (12 * 0.0301 * 2.149e-3) = 5.652401e-11
DRIVER_GAP = 5.652401e-11
# Couette h H R omega/2 = 150e-6 * 13e-3 * 29.1e-3 * 209.4395/2 = 5.942323e-6
DRIVER_DRAG = 5.942323e-6


def denser(bar):
    """rho/rho_0 at so many bar: what turns a volume flow into mass flow over rho_0."""
    return np.exp(bar * BAR / 5e8)


def test_eq_24_by_hand():
    """Driver, 2000 rpm, 5 bar, volume at 2 bar; seven digits worked out above, as mass at 1 and at 3.5 bar."""
    found = at(chain(), 1 * DEG, p=[2 * BAR])
    by_hand = [(2e5 * DRIVER_GAP - DRIVER_DRAG) * denser(1), (3e5 * DRIVER_GAP - DRIVER_DRAG) * denser(3.5)]
    np.testing.assert_allclose(found["q_gaps"], by_hand, rtol=2e-6)
    assert found["q_delivery"] == found["q_tip"] == found["q_gaps"][1]
    assert found["q_suction"] == -found["q_gaps"][0]


def test_eq_25_by_hand():
    """Driven gear: l_to 2.478 mm, R_t2 28.6 mm, tau 13/16."""
    part = chain(extension=34 * DEG * (16 / 13) ** 2, gap_length=2.478e-3, tip_radius=28.6e-3, speed_ratio=13 / 16)
    drop, drag = 3e5 * 13e-3 * 3.375e-12 / (12 * 0.0301 * 2.478e-3), 150e-6 * 13e-3 * 28.6e-3 * 0.8125 * OMEGA / 2
    assert at(part, 1 * DEG, p=[2 * BAR])["q_tip"] == pytest.approx((drop - drag) * denser(3.5), rel=1e-9)


def test_pressure_rate_by_hand():
    """Eq. 2 at 0 bar gauge, where rho_0/rho = 1: beta/V times what comes in, 2 cm3/s of it from outside.

    Over the second tip it comes at 2.5 bar in the mean, and the drag there takes away denser oil than the first brings.
    """
    found = at(chain(), 1 * DEG, p=[0.0], q_chain=[2e-6])
    inflow = (5e5 * DRIVER_GAP - DRIVER_DRAG) * denser(2.5) + DRIVER_DRAG + 2e-6
    assert found["der_p"][0] == pytest.approx(5e8 / 566.75e-9 * inflow, rel=2e-6)


def test_drag_acts_towards_delivery():
    """At equal pressures the tips carry oil to delivery."""
    found = at(chain(), 1 * DEG, p=[0.0], p_delivery=0.0)
    assert found["q_delivery"] < 0 < found["q_suction"]
    assert found["der_p"][0] == 0


@pytest.mark.parametrize(("volumes", "extension", "sealed"), [(1, 34, 6.3077), (2, 60, 4.6154), (1, 30, 2.3077)])
def test_last_volume_opens_when_the_crescent_ends(volumes, extension, sealed):
    """It exists for extension - N pitch after each closing; the others always do."""
    part = chain(volumes, extension * DEG)
    p = np.full(volumes, 2 * BAR)
    before, after = at(part, (sealed - 1e-3) * DEG, p=p), at(part, (sealed + 1e-3) * DEG, p=p)
    assert list(before["exists"]) == [1.0] * volumes
    assert list(after["exists"]) == [1.0] * (volumes - 1) + [0.0]


@pytest.mark.parametrize(("volumes", "extension"), [(1, 34), (2, 60), (4, 115)])
def test_a_volume_opens_extension_less_one_pitch_after_it_closed(volumes, extension):
    """The tip before it came to the crescent a pitch before it closed, and leaves after `extension`: the volume is
    followed from its closing through the places of the chain, shift by shift."""
    part = chain(volumes, extension * DEG)
    age = extension * DEG - PITCH
    for after, carried in ((age - 1e-6, True), (age + 1e-6, False)):
        shifts, turned = divmod(after, PITCH)
        exists = at(part, turned, p=np.full(volumes, BAR))["exists"]
        assert (shifts < volumes and exists[int(shifts)] == 1.0) == carried


@pytest.mark.parametrize(("degrees", "contacts"), [(34, 1.2278), (40, 1.4444), (46, 1.6611), (52, 1.8778)])
def test_mean_number_of_tips_is_that_of_table_4(degrees, contacts):
    """Table 4: 1.22, 1.44, 1.65, 1.87 contacts (exactly extension/27.6923 deg), one tip more than volumes."""
    part = chain(1, degrees * DEG)
    phases = (np.arange(1000) + 0.5) / 1000 * PITCH
    tips = [1 + np.sum(at(part, x, p=[0.0])["exists"]) for x in phases]
    assert np.mean(tips) == pytest.approx(contacts, abs=1.1e-3)


def test_open_volume_has_the_delivery_pressure_and_passes_its_flows_on():
    """Delivery meets V_(N-1): its flow crosses tip N, what enters V_N from outside arrives at delivery."""
    found = at(chain(2, 60 * DEG), 20 * DEG, p=[1 * BAR, 3 * BAR], q_chain=[0.0, 4e-6])
    assert list(found["p_chain"]) == [1 * BAR, 5 * BAR]
    assert found["der_p"][1] == 0
    assert found["q_gaps"][2] == 0
    over_tip = (4e5 * DRIVER_GAP - DRIVER_DRAG) * denser(3)  # between 1 and 5 bar
    assert found["q_tip"] == found["q_gaps"][1] == pytest.approx(over_tip, rel=2e-6)
    assert found["q_delivery"] == pytest.approx(found["q_tip"] - 4e-6, rel=1e-12)


@pytest.mark.parametrize("phase", [1.0, 20.0])
@pytest.mark.parametrize(("volumes", "extension"), [(0, 20), (1, 34), (2, 60), (4, 115)])
def test_flows_change_the_content(volumes, extension, phase):
    """The sum of all flows into the component is the rate of what it stores, exactly (central differences, 1e-6)."""
    part = chain(volumes, extension * DEG)
    rng = np.random.default_rng(volumes)
    p, q = 5e5 * rng.random(volumes), 1e-5 * rng.standard_normal(volumes)
    found = at(part, phase * DEG, p=p, q_chain=q)
    step = 1e3
    rate = 0.0
    for k in range(volumes):
        d = np.zeros(volumes)
        d[k] = step
        up, down = (at(part, phase * DEG, p=p + s * d, q_chain=q)["content"] for s in (1, -1))
        rate += (up - down) / (2 * step) * found["der_p"][k]
    flows = found["q_suction"] + found["q_delivery"] + np.sum(q)
    assert flows == pytest.approx(rate, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("phase", [1.0, 20.0])
@pytest.mark.parametrize(("volumes", "extension"), [(0, 20), (1, 34), (2, 60), (4, 115)])
def test_what_enters_is_stored_or_lost(volumes, extension, phase):
    """While the last volume exists and while it is open, with drag either way."""
    turned = (phase * DEG, phase * DEG)
    check_energy(
        Case(chain(volumes, extension * DEG), OIL, {"phase": turned, "closed_at": (0, 0), "omega_shaft": (-300, 300)})
    )


def test_drag_works_against_the_whole_rise():
    """Brought: h H R omega/2 times p_d - p_s over all sealed tips, whatever lies between them; lost is each drop's.

    To (dp/beta)^2/24, 1e-7: rho at a gap's mean pressure times the rise of enthalpy, int dp/rho, is the rise of p.
    """
    p = [1 * BAR, 4 * BAR]
    found = at(chain(2, 60 * DEG), 1 * DEG, p=p)
    assert found["supply"] == pytest.approx(5 * BAR * DRIVER_DRAG, rel=2e-6)
    assert found["loss"] == pytest.approx((np.diff([0.0, *p, 5 * BAR]) ** 2).sum() * DRIVER_GAP, rel=2e-6)
    opened = at(chain(2, 60 * DEG), 20 * DEG, p=p)
    assert opened["supply"] == pytest.approx(found["supply"], rel=1e-6)
    assert opened["stored_energy"] == pytest.approx(566.75e-9 * (5e8 * np.expm1(BAR / 5e8) - BAR), rel=1e-6)


def test_chain_shifts_by_one_place():
    """A new volume closes with the suction's pressure, the others move up, the last is gone to delivery."""
    event = at(chain(4, 115 * DEG), PITCH + 1e-9, p=[1e5, 2e5, 3e5, 4e5], p_suction=-1e4)["closes"]
    assert event.condition
    np.testing.assert_allclose(event.then["p"], [-1e4, 1e5, 2e5, 3e5])
    assert event.then["closed_at"] == pytest.approx(PITCH)
    assert not at(chain(4, 115 * DEG), PITCH - 1e-9, p=[1e5, 2e5, 3e5, 4e5])["closes"].condition


def test_after_the_shift_the_last_volume_exists_again():
    """The new last volume carries the pressure of the one before it, not what the open one had."""
    part = chain(2, 60 * DEG)
    then = at(part, PITCH, p=[1e5, 9e5])["closes"].then
    found = at(part, PITCH, p=then["p"], closed_at=then["closed_at"])
    assert list(found["exists"]) == [1.0, 1.0]
    np.testing.assert_allclose(found["p_chain"], [0.0, 1e5])


def test_no_volumes_leave_one_gap():
    """With N = 0 a single tip gap lies between delivery and suction; the shift has nothing to move."""
    part = chain(0, 20 * DEG)
    for phase in (1 * DEG, 25 * DEG):
        found = at(part, phase)
        assert found["q_tip"] == found["q_delivery"] == -found["q_suction"]
        assert found["q_tip"] == pytest.approx((5e5 * DRIVER_GAP - DRIVER_DRAG) * denser(2.5), rel=2e-6)
        assert found["p_chain"].shape == found["der_p"].shape == found["exists"].shape == (0,)
        assert found["content"] == 0
    assert at(part, PITCH)["closes"].then["p"].shape == (0,)


@pytest.mark.parametrize("phase", [0.0, 0.3, 12.0, -3.0])
def test_any_start_phase(phase):
    """At the start the chain finds its place from the phase; no volume shifts."""
    found = at(chain(), phase, p=[1e5], started=0.0)
    assert found["begins"].condition
    assert not found["closes"].condition
    assert 0 <= phase - found["begins"].then["closed_at"] < PITCH
    assert found["begins"].then["closed_at"] / PITCH == pytest.approx(round(found["begins"].then["closed_at"] / PITCH))
    assert set(found["begins"].then) == {"closed_at", "started"}


@pytest.mark.parametrize(("gear", "name"), [("driver", "driver_phase"), ("driven", "driven_phase")])
@pytest.mark.parametrize("degrees", [34, 52])
def test_chain_and_gears_agree_on_when_volumes_exist(gear, name, degrees):
    """The delivery volume grows by a tooth space at the angle where the chain's last volume ends."""
    gears = CrescentGears(crescent_extension=degrees * DEG)
    c = gears.chambers
    extension, opens = getattr(c, f"{gear}_extension"), getattr(c, f"{gear}_opens")
    part = chain(int(extension / PITCH), extension)
    p = np.zeros(part.volumes)

    def exists(nu):
        phase = gears.equations(
            phi_shaft=nu, omega_shaft=1.0, mesh_start=0.0, started=1.0, p_delivery=0.0, p_suction=0.0, p_trapped=0.0
        )[name]
        return at(part, phase, p=p, closed_at=PITCH * np.floor(phase / PITCH))["exists"][-1]

    assert (exists(opens - 1e-9), exists(opens + 1e-9)) == (1.0, 0.0)


@pytest.mark.parametrize(("volumes", "write"), [(0, 1), (2, 1)])
def test_number_of_volumes_must_fit_the_crescent(volumes, write):
    """Eq. 1: N is the whole part of extension/pitch."""
    when = "opens extension less one pitch after it closed"
    with pytest.raises(ValidationError, match=f"{when}; write volumes: {write}"):
        chain(volumes)


# --- the trapped volume -------------------------------------------------------------------------------------------


def trapped(exists, p_own=8 * BAR, q_port=1e-6, V=40e-9, dV=-2e-6):
    return TrappedVolume().equations(
        p_own=p_own, q_port=q_port, p_delivery=5 * BAR, V_chamber=V, dV_chamber=dV, exists=exists, fluid=OIL
    )


def test_trapped_volume_obeys_eq_2_while_it_exists():
    """beta/V (rho_0/rho q - dV/dt) by hand; its pressure acts on port and gears, delivery gets nothing."""
    found = trapped(1.0)
    assert found["p_port"] == found["p_chamber"] == found["p"] == 8 * BAR
    assert found["der_p_own"] == pytest.approx(5e8 / 40e-9 * (np.exp(-8e5 / 5e8) * 1e-6 + 2e-6), rel=1e-12)
    assert found["q_delivery"] == 0


def test_trapped_volume_is_delivery_while_it_does_not_exist():
    """Its pressure is the delivery's and its flows pass on."""
    found = trapped(0.0)
    assert found["p_port"] == found["p_chamber"] == 5 * BAR
    assert found["q_delivery"] == -1e-6
    assert found["der_p_own"] == found["content"] == 0


def test_trapped_volume_appears_with_the_delivery_pressure():
    """Section 2.1: a part of the delivery volume becomes the trapped one."""
    assert trapped(1.0)["appears"].condition
    assert trapped(1.0)["appears"].then == {"p_own": 5 * BAR}
    assert not trapped(0.0)["appears"].condition


def test_trapped_content_follows_its_flow():
    """d(V rho/rho_0)/dt = q, central differences in time, 1e-6."""
    dt, rate = 1e-7, trapped(1.0)["der_p_own"]
    later, earlier = (trapped(1.0, p_own=8 * BAR + s * dt * rate, V=40e-9 - s * dt * 2e-6)["content"] for s in (1, -1))
    assert (later - earlier) / (2 * dt) == pytest.approx(1e-6, rel=1e-6)


@pytest.mark.parametrize(("exists", "grows"), [(1.0, (-1e-5, 1e-5)), (0.0, (0.0, 0.0))])
def test_trapped_volume_stores_what_enters(exists, grows):
    """While it exists the flow and the gears' work; while it does not, its flow leaves to delivery with its power."""
    check_energy(Case(TrappedVolume(), OIL, {"exists": (exists, exists), "dV_chamber": grows}))
