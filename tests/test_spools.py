"""Edges of spools, poppets and flappers: limits, signs, reversal, damping; their figures are in `evidence`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from building import OIL as OIL_TEXT
from building import circuit
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.poppets import BallPoppet, ConicalPoppet, FlapperNozzle
from crescentlab.components.spools import AnnularPort, RectangularSlots, TriangularNotches
from crescentlab.components.valve_laws import edge_share, middle_share, opening
from crescentlab.components.valve_parts import RoundHoles
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.optimize import brentq

BAR, MM, LPM = 1e5, 1e-3, 1e-3 / 60
OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)
PARTS = Path(__file__).parent.parent / "circuits"
EDGES = [
    AnnularPort(diameter=10 * MM),
    RectangularSlots(number=4, width=3 * MM, length=2 * MM),
    TriangularNotches(number=4, length=2 * MM),
    RoundHoles(number=4, diameter=2 * MM),
]
POPPETS = [ConicalPoppet(seat_diameter=6 * MM), BallPoppet(seat_diameter=6 * MM, ball_diameter=8 * MM)]


def at(part: Any, x: float, p_a: float = 50 * BAR, p_b: float = 0.0, v: float = 0.0) -> dict[str, Any]:
    """A part's equations at a position, pressures and a velocity."""
    return part.equations(p_a=p_a, p_b=p_b, x_rod=x, v_rod=v, fluid=OIL)


def name(part: Any) -> str:
    return part.type_name()


# --- how an edge opens ------------------------------------------------------------------------------------------------


def test_opening_is_smooth() -> None:
    """Nothing up to the edge, the travel beyond the rounding, and the slope is that of the opening throughout."""
    w = 1e-6
    assert opening(-1e-3, w) == opening(0.0, w) == (0.0, 0.0)
    assert opening(1e-3, w) == (pytest.approx(1e-3, rel=1e-12), 1.0)
    for x in np.linspace(-0.5 * w, 2 * w, 26):
        middle, _ = quad(lambda s: opening(s, w)[1], -0.5 * w, x, points=[0.0, w])
        assert opening(x, w)[0] == pytest.approx(middle, abs=1e-9 * w)


@pytest.mark.parametrize("overlap", [-0.3, 0.0, 0.1])
def test_share_of_an_edge(overlap: float) -> None:
    """Closed before overlap - w, linear beyond overlap + w, 1 from full stroke on; it never falls."""
    w = 0.02
    assert edge_share(overlap - w, overlap, w) == pytest.approx(0.0, abs=1e-15)
    assert edge_share(1.0, overlap, w) == pytest.approx(1.0, rel=1e-12)
    x = (1 + overlap) / 2
    assert edge_share(x, overlap, w) == pytest.approx(0.5, rel=1e-12)
    assert np.all(np.diff(edge_share(np.linspace(-1.0, 1.0, 401), overlap, w)) >= 0)


@pytest.mark.parametrize("closed", [0.1, 0.5, 1.0])
def test_share_of_an_edge_that_is_open_in_the_middle(closed: float) -> None:
    """1 in the middle, w/4 of the stroke open at `closed` and shut beyond, linear between, even, smooth at 0."""
    w = 0.02
    assert middle_share(0.0, closed, w) == pytest.approx(1.0, rel=1e-12)
    assert middle_share(closed, closed, w) == pytest.approx(w / 4 / (closed - w / 2), rel=1e-12)
    if closed < 1:
        assert middle_share(closed + w, closed, w) == pytest.approx(0.0, abs=1e-15)
    assert middle_share(closed / 2, closed, w) == pytest.approx(closed / 2 / (closed - w / 2), rel=1e-12)
    x = np.linspace(0.0, 1.0, 401)
    there, back = middle_share(x, closed, w), middle_share(-x, closed, w)
    assert np.all(there == back)
    assert np.all(np.diff(there) <= 0)
    steps = np.diff(middle_share(np.linspace(-w, w, 401), closed, w))
    assert np.abs(np.diff(steps)).max() == pytest.approx((2 * w / 400) ** 2 / (w * (closed - w / 2)), rel=1e-6)


@pytest.mark.parametrize("part", EDGES, ids=name)
def test_closed_and_mirrored(part: Any) -> None:
    """Nothing passes at overlap; an edge that opens downwards does at -x what the other does at x, its force turned."""
    assert at(part, 0.0)["q"] == at(part, -1 * MM)["q"] == 0.0
    down = type(part)(**{**part.model_dump(), "opens": "down"})
    one, other = at(part, 0.4 * MM), at(down, -0.4 * MM)
    assert one["q"] == other["q"] > 0
    assert one["f_rod"] == -other["f_rod"] > 0
    assert one["jet_force"] == other["jet_force"]


@pytest.mark.parametrize("part", EDGES, ids=name)
def test_flow_force_closes_both_ways(part: Any) -> None:
    """The jet closes whichever way the fluid flows; jet_coefficient turns or removes it, the flow stays."""
    there, back = at(part, 0.4 * MM), at(part, 0.4 * MM, p_a=0.0, p_b=50 * BAR)
    assert back["q"] == -there["q"]
    assert back["jet_force"] == there["jet_force"] > 0
    opens = type(part)(**{**part.model_dump(), "jet_coefficient": -0.5})
    assert at(opens, 0.4 * MM)["jet_force"] == pytest.approx(-0.5 * there["jet_force"], rel=1e-12)
    assert at(opens, 0.4 * MM)["q"] == there["q"]


@pytest.mark.parametrize("opens", ["up", "down"])
@pytest.mark.parametrize("part", EDGES, ids=name)
def test_transient_force_damps_outflow(part: Any, opens: str) -> None:
    """Against the velocity for flow out of the spool's chamber, with it for flow into it; L dm/dt, m = rho_0 q."""
    long = type(part)(**{**part.model_dump(), "opens": opens, "damping_length": 20 * MM, "lambda_c": 1e-3})
    x, v, dt = 0.4 * MM * (1 if opens == "up" else -1), 0.1, 1e-7
    force = at(long, x, v=v)["transient_force"]
    assert force * v > 0
    assert at(long, x, v=v)["f_rod"] - at(long, x)["f_rod"] == pytest.approx(force, rel=1e-9)
    assert at(long, x, p_a=0.0, p_b=50 * BAR, v=v)["transient_force"] == pytest.approx(-force, rel=1e-12)
    rate = (at(long, x + v * dt)["q"] - at(long, x - v * dt)["q"]) / (2 * dt)
    toward = 20 * MM * 860.0 * rate * (1 if opens == "up" else -1)
    assert force == pytest.approx(toward, rel=1e-6)


def test_round_holes_and_slots_agree_where_they_must() -> None:
    """A slot as wide as a hole's chord passes in its middle, per travel, what the hole does: dA/dx = 2 r."""
    holes, slot = RoundHoles(diameter=4 * MM), RectangularSlots(width=4 * MM, length=4 * MM)
    steps = [at_x * MM for at_x in (1.999, 2.001)]
    of_holes = [at(holes, x)["area"] for x in steps]
    assert of_holes[1] - of_holes[0] == pytest.approx(at(slot, steps[1])["area"] - at(slot, steps[0])["area"], rel=1e-6)


def test_slot_and_hole_end() -> None:
    """Beyond its length a slot opens no further, nor does a hole, and their transient force is gone."""
    slot = RectangularSlots(width=3 * MM, length=2 * MM, damping_length=20 * MM)
    hole = RoundHoles(diameter=2 * MM, damping_length=20 * MM)
    for part, area in ((slot, 6e-6), (hole, math.pi * 1e-6)):
        assert at(part, 5 * MM)["area"] == pytest.approx(area, rel=1e-12)
        assert at(part, 5 * MM, v=0.1)["transient_force"] == 0.0


# --- poppets ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", POPPETS, ids=name)
def test_poppet_on_its_seat(part: Any) -> None:
    """Shut, with the pressure on its seat; in motion it takes in the seat's area times its speed."""
    shut = at(part, 0.0)
    assert shut["q"] == 0.0
    assert shut["f_rod"] == pytest.approx(-50 * BAR * 9 * math.pi * 1e-6, rel=1e-12)
    moving = at(part, 0.0, v=0.2)
    assert moving["q_a"] == pytest.approx(math.exp(50 / 14000) * 9 * math.pi * 1e-6 * 0.2, rel=1e-12)
    assert moving["q_b"] == 0.0


@pytest.mark.parametrize("part", POPPETS, ids=name)
def test_poppet_with_a_wider_face(part: Any) -> None:
    """The ring outside the seat feels and takes in what is at b: pi/4 (10^2 - 6^2) = 16 pi mm^2."""
    wide = type(part)(**{**part.model_dump(exclude={"face_diameter"}), "face_diameter": 10 * MM})
    one, other = at(part, 0.3 * MM, p_b=20 * BAR, v=0.1), at(wide, 0.3 * MM, p_b=20 * BAR, v=0.1)
    assert other["force"] - one["force"] == pytest.approx(20 * BAR * 16 * math.pi * 1e-6, rel=1e-12)
    assert other["q_b"] - one["q_b"] == pytest.approx(math.exp(20 / 14000) * 16 * math.pi * 1e-6 * 0.1, rel=1e-9)


@pytest.mark.parametrize("part", POPPETS, ids=name)
def test_poppet_reversed(part: Any) -> None:
    """The flow turns round with the drop; the jet closes all the same."""
    there, back = at(part, 0.3 * MM), at(part, 0.3 * MM, p_a=0.0, p_b=50 * BAR)
    assert back["q"] == -there["q"]
    assert back["jet_force"] == there["jet_force"] > 0


@pytest.mark.parametrize("part", POPPETS, ids=name)
def test_area_rises_to_the_bore(part: Any) -> None:
    """Monotonic from 0 to the bore over any lift."""
    areas = np.array([at(part, x)["area"] for x in np.linspace(0.0, 20 * MM, 401)])
    assert np.all(np.diff(areas) >= 0)
    assert areas[-1] == pytest.approx(9 * math.pi * 1e-6, rel=1e-12)


def test_large_ball_is_a_cone() -> None:
    """A ball lifts at first as the cone that touches it at the seat: half angle acos(r/R), 1 % of x/d at 10 um."""
    ball = BallPoppet(seat_diameter=6 * MM, ball_diameter=8 * MM)
    cone = ConicalPoppet(seat_diameter=6 * MM, half_angle=math.acos(6 / 8))
    assert at(ball, 1e-5)["area"] == pytest.approx(at(cone, 1e-5)["area"], rel=5e-3)
    assert at(ball, 1e-5)["jet_force"] == pytest.approx(at(cone, 1e-5)["jet_force"], rel=5e-3)


def test_seats_that_do_not_fit() -> None:
    """A face inside its seat, a ball that falls through."""
    with pytest.raises(ValidationError, match=r"face_diameter \(5 mm\) must be at least seat_diameter \(6 mm\)"):
        ConicalPoppet(seat_diameter=6 * MM, face_diameter=5 * MM)
    with pytest.raises(ValidationError, match=r"ball_diameter \(6 mm\) must be larger than seat_diameter \(6 mm\)"):
        BallPoppet(seat_diameter=6 * MM, ball_diameter=6 * MM)


# --- flapper ----------------------------------------------------------------------------------------------------------


def test_double_flapper_is_balanced() -> None:
    """Two nozzles that face each other: no force in the middle; off it the faster jet of the wider gap pushes away.

    For equal pressures dF/dx = 64 p A_N Cd^2 x_0/d^2 (Merritt, chapter 5); 1e-3 for the flow number.
    """
    up = FlapperNozzle(diameter=1 * MM, gap=0.1 * MM, side="pushes_up")
    down = FlapperNozzle(diameter=1 * MM, gap=0.1 * MM, side="pushes_down")

    def force(x: float) -> float:
        forces = [n.equations(p_a=50 * BAR, p_b=0.0, x_rod=x, fluid=OIL)["force"] for n in (up, down)]
        return float(sum(forces))

    assert force(0.0) == 0.0
    slope = 64 * 50 * BAR * math.pi / 4 * 1e-6 * 0.64**2 * 0.1 * MM / (1 * MM) ** 2
    assert (force(1e-6) - force(-1e-6)) / 2e-6 == pytest.approx(slope, rel=1e-3)


def test_flapper_shut_and_reversed() -> None:
    """On the nozzle it feels p A_N and nothing passes; backwards the flow turns round, without a jet on the flapper."""
    nozzle = FlapperNozzle(diameter=1 * MM)
    shut = nozzle.equations(p_a=50 * BAR, p_b=0.0, x_rod=-0.1 * MM, fluid=OIL)
    assert shut["q"] == 0.0
    assert shut["force"] == pytest.approx(50 * BAR * math.pi / 4 * 1e-6, rel=1e-12)
    there = nozzle.equations(p_a=50 * BAR, p_b=0.0, x_rod=0.1 * MM, fluid=OIL)
    back = nozzle.equations(p_a=0.0, p_b=50 * BAR, x_rod=0.1 * MM, fluid=OIL)
    assert back["q"] == -there["q"]
    assert back["force"] == pytest.approx(-50 * BAR * math.pi / 4 * 1e-6, rel=1e-12)


# --- a check valve of parts -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flow", [5, 20])
def test_check_valve_of_parts(flow: float) -> None:
    """At rest dp A = F_0 + k x + rho q v cos 45 deg and q = Cd A(x) v, solved by hand; 2e-3 for Cd just under 0.7."""
    parts = {
        "pump": {"type": "flow_source", "flow": f"{flow} L/min"}, "tank": {"type": "tank"},
        "line": {"type": "capacity", "volume": "200 cm^3"},
        "valve": {"type": "./poppet_check_valve_part.yaml", "spring_rate": "10 N/mm"},
    }  # fmt: skip
    nets = {"p": ["pump.port", "line.port", "valve.inlet"], "t": ["valve.outlet", "tank.port"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, folder=PARTS, simulation={"stop": "200 ms"}).simulate()
    bore, q, sine = math.pi / 4 * 1e-4, flow * LPM, math.sqrt(0.5)

    def missing(x: float) -> float:
        v = q / (0.7 * math.pi * x * sine * (10 * MM - x * sine * sine))
        return 860 * v * v / 2 * bore - (0.5 * BAR * bore + 10e3 * x + 860 * q * v * sine)

    lift = brentq(missing, 1e-6, 3 * MM)
    v = q / (0.7 * math.pi * lift * sine * (10 * MM - lift * sine * sine))
    assert run["valve.x"][-1] == pytest.approx(lift, rel=2e-3)
    assert run["line.p"][-1] == pytest.approx(430 * v * v, rel=2e-3)
    assert run.balance is not None
    assert run.balance.circuit < 1e-6


def test_check_valve_of_parts_holds() -> None:
    """Backwards the poppet sits on its seat and nothing passes."""
    parts = {
        "supply": {"type": "pressure_source", "pressure": "50 bar"}, "line": {"type": "capacity", "volume": "200 cm^3"},
        "valve": {"type": "./poppet_check_valve_part.yaml"},
    }  # fmt: skip
    nets = {"s": ["supply.port", "valve.outlet"], "p": ["line.port", "valve.inlet"]}
    run = circuit(components=parts, nets=nets, fluid=OIL_TEXT, folder=PARTS, simulation={"stop": "10 ms"}).simulate()
    assert np.all(run["line.p"] == 0)
    assert np.all(run["valve.x"] == 0)
