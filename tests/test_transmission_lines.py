"""The transmission line: exact delay, sharp fronts, friction in lumps, fluid kept, and its ends in circuits."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import numpy as np
import pytest
from building import circuit
from crescentlab.components.delay_waves import Waves, without_overshoot
from crescentlab.components.flow_laws import pipe_friction_drop
from crescentlab.components.fluids import SimpleOil
from crescentlab.components.transmission_lines import TransmissionLine, TransmissionLineTakesTakes
from evidence.transmission_lines import FORMS, Ticked

from crescentlab.analysis.linear.frequency import frequency_response
from crescentlab.commands.check import facts
from crescentlab.errors import InputError, SimulationError

THIN = SimpleOil(density=870.0, kinematic_viscosity=1e-12, bulk_modulus=1.6e9)
OIL = SimpleOil(density=870.0, kinematic_viscosity=46e-6, bulk_modulus=1.6e9)
TEXT = {"type": "simple_oil", "density": "870 kg/m^3", "kinematic_viscosity": "46 cSt", "bulk_modulus": "1.6 GPa"}
WAVE = math.sqrt(1.6e9 / 870)
AREA = math.pi / 4 * 0.01**2
IMPEDANCE = 870 * WAVE / AREA
SIZE: dict[str, Any] = {"length": 2.0, "diameter": 0.01, "mean_pressure": 0.0}


def test_family() -> None:
    assert TransmissionLine.type_name() == "transmission_line"
    roles = {tuple(port.role for port in form.ports()) for form in TransmissionLine.forms()}
    assert roles == set(itertools.product(["takes", "gives"], repeat=2))


@pytest.mark.parametrize("lumps", [1, 2, 5])
@pytest.mark.parametrize("ticks_per_period", [7.0, 13.5, 40.0])
def test_waves_arrive_as_they_were_sent(lumps: int, ticks_per_period: float) -> None:
    """Flow q(t) into end a doubles at the closed end b a delay later: p_b(t) = 2 Z q(t - T), until it is back at 3 T.

    At ticks to rounding, whatever the wave's period (laminar friction takes 1e-9 of it). d'Alembert.
    """
    wave = 2 * math.pi / (ticks_per_period * 2.0 / WAVE / (2 * lumps))

    def flow(t: float) -> float:
        return 1e-12 * math.sin(wave * t)

    run = Ticked("qq", THIN, flow, lambda t: 0.0, **SIZE, lumps=lumps)
    delay = 2.0 / WAVE
    for k in range(1, 6 * lumps):
        run.step()
        expected = 2 * IMPEDANCE * flow(k * run.dt - delay) if k > 2 * lumps else 0.0
        assert run.at(k * run.dt)["p_b"] == pytest.approx(expected, abs=1e-8 * IMPEDANCE * 1e-12), k


def test_between_ticks_the_wave_is_of_third_order() -> None:
    """The largest error between ticks of a smooth wave falls as ticks cubed, or faster: order 2.8 or more."""
    errors = []
    for lumps in (5, 10, 20):
        run = Ticked("qq", THIN, lambda t: 1e-6 * math.sin(3e3 * t) ** 2, lambda t: 0.0, **SIZE, lumps=lumps)
        error = 0.0
        for k in range(5 * lumps):
            if k > 2 * lumps:
                for share in (0.15, 0.5, 0.8):
                    t = (k + share) * run.dt
                    expected = 2 * IMPEDANCE * 1e-6 * math.sin(3e3 * (t - 2.0 / WAVE)) ** 2
                    error = max(error, abs(run.at(t)["p_b"] - expected))
            run.step()
        errors.append(error)
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 2.8, errors


@pytest.mark.parametrize("kind", FORMS)
@pytest.mark.parametrize("terms", [0, 10])
def test_fluid_is_kept_and_ends_are_continuous(kind: str, terms: int) -> None:
    """Content changes by what the ends take in, ticks included, and at a tick no end jumps: to rounding.

    Both by construction; smooth ends of two frequencies on steady turbulent flow, with friction and losses.
    """
    oil = SimpleOil(density=870.0, kinematic_viscosity=2e-6, bulk_modulus=1.6e9)
    steady = Ticked("pq", oil, lambda t: 0.0, lambda t: 0.0, **SIZE, start_flow=3e-4, loss_coefficient=0.5)
    drop = float(steady.world["drop"].sum())
    ends = {
        "p": (lambda t: 4e5 + 1e4 * (1 - math.cos(900 * t)), lambda t: 4e5 - drop + 1e4 * (1 - math.cos(700 * t))),
        "q": (lambda t: 3e-4 * (1.01 - 0.01 * math.cos(900 * t)), lambda t: -3e-4 * (0.99 + 0.01 * math.cos(700 * t))),
    }  # fmt: skip
    run = Ticked(
        kind, oil, ends[kind[0]][0], ends[kind[1]][1], **SIZE, friction_terms=terms, loss_coefficient=0.5,
        start_pressure=4e5, start_flow=3e-4,
    )  # fmt: skip
    content = run.at(0.0)["content"]
    names = ("p_a" if kind[0] == "q" else "der_into_a", "p_b" if kind[1] == "q" else "der_into_b", "content")
    for _ in range(150):
        t = (run.ticks + 1) * run.dt
        run_before = dict(run.world)
        run.step()
        after = run.at(t)
        run.world, now = run_before | {k: run.world[k] for k in ("into_a", "into_b")}, dict(run.world)
        before = run.at(t)
        run.world = now
        for name in names:
            size = {"p": 4e5, "d": 3e-4, "c": content}[name[0]]
            assert after[name] == pytest.approx(before[name], abs=1e-12 * size), name
    taken = float(run.world["into_a"][0] + run.world["into_b"][0])
    assert run.at(run.ticks * run.dt)["content"] - content == pytest.approx(taken, abs=1e-12 * content)


@pytest.mark.parametrize("kind", FORMS)
@pytest.mark.parametrize("nu", [46e-6, 1e-6], ids=["laminar", "turbulent"])
def test_steady_flow_stays(kind: str, nu: float) -> None:
    """Started at its steady flow the line keeps it over 200 ticks: 128 mu l q/(pi d^4), or Churchill's drop.

    The drop is that of all lumps to 1e-9; the start is exact, so only rounding of 20 bar moves it.
    """
    oil, q = SimpleOil(density=870.0, kinematic_viscosity=nu, bulk_modulus=1.6e9), 2e-4
    drop = float(pipe_friction_drop(q, 2.0, 0.01, 0.0, oil, 0.0))
    if nu == 46e-6:
        assert drop == pytest.approx(128 * 46e-6 * 870 * 2.0 * q / (math.pi * 0.01**4), rel=1e-6)
    given = {"p": (20e5, 20e5 - drop), "q": (q, -q)}
    run = Ticked(
        kind, oil, lambda t: given[kind[0]][0], lambda t: given[kind[1]][1], **SIZE, friction_terms=3,
        start_pressure=20e5, start_flow=q,
    )  # fmt: skip
    for _ in range(200):
        run.step()
    found = run.at(run.ticks * run.dt)
    if kind[0] == "q":
        assert found["p_a"] == pytest.approx(20e5, rel=1e-9)
    if kind[1] == "q":
        assert found["p_b"] == pytest.approx(20e5 - drop, rel=1e-9)
    assert found["der_into_a"] == pytest.approx(q, rel=1e-6)
    assert found["der_into_b"] == pytest.approx(-q, rel=1e-6)


def test_settles_to_the_steady_drop() -> None:
    """From rest, a flow of 1e-4 m^3/s settles to Hagen-Poiseuille's drop: e^-12 of the start remains."""
    thick, q = SimpleOil(density=870.0, kinematic_viscosity=460e-6, bulk_modulus=1.6e9), 1e-4
    run = Ticked("pq", thick, lambda t: 20e5, lambda t: -q, **SIZE, lumps=3, friction_terms=10, start_pressure=20e5)
    for _ in range(450):
        run.step()
    drop = 128 * 460e-6 * 870 * 2.0 * q / (math.pi * 0.01**4)
    assert 20e5 - run.at(run.ticks * run.dt)["p_b"] == pytest.approx(drop, rel=1e-4)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_fronts_do_not_overshoot(share: float) -> None:
    """A jump from 0 to 1 at any share of a tick is a straight line between values that were there, of the same mean."""
    zero, one = np.zeros(1), np.ones(1)
    rest = Waves(zero, zero, zero)
    wave = without_overshoot(Waves(zero, one, np.array([1 - share])), rest)
    seen = [float(wave.at(x)[0]) for x in np.linspace(0, 1, 11)]
    assert min(seen) >= -1e-12
    assert max(seen) <= 1 + 1e-12
    assert np.trapezoid(seen, dx=0.1) == pytest.approx(1 - share, abs=2e-3)


def test_crests_are_no_fronts() -> None:
    """The crest of a sine of 12 ticks bends over a tick as over the one before, and is left as it is."""
    edge = np.sin(2 * np.pi * (np.arange(14) + 0.3) / 12)
    mean = -np.diff(np.cos(2 * np.pi * (np.arange(14) + 0.3) / 12)) * 12 / (2 * np.pi)
    for k in range(1, 13):
        cells = [Waves(*(np.array([v]) for v in (edge[j], edge[j + 1], mean[j]))) for j in (k - 1, k)]
        kept = without_overshoot(cells[1], cells[0])
        assert (kept.begin, kept.end) == (edge[k], edge[k + 1]), k


def test_elastic_wall_delays() -> None:
    """The tick is L/(2 n a), a = [rho (1/beta + C)]^-1/2 with the compliance C of the wall, at mean_pressure 0."""
    values = {**SIZE, "wall_thickness": 1e-3, "youngs_modulus": 10e9}
    run = Ticked("qq", OIL, lambda t: 0.0, lambda t: 0.0, **values, lumps=4)
    compliance = 2 / 10e9 * ((6e-3**2 + 5e-3**2) / (6e-3**2 - 5e-3**2) + 0.3)  # Lame
    a = (870 * (1 / 1.6e9 + compliance)) ** -0.5
    assert run.dt == pytest.approx(2.0 / (8 * a), rel=1e-12)
    with pytest.raises(ValueError, match="wall_thickness is missing"):
        TransmissionLineTakesTakes(**SIZE, youngs_modulus=10e9)


# -- in circuits ---------------------------------------------------------------------------------


def hammer(opening: dict[str, str], **values: str) -> Any:
    """20 bar, 10 m of 20 mm bore, 1 m/s, and a valve that prescribes its flow."""
    return circuit(
        components={
            "reservoir": {"type": "pressure_source", "pressure": "20 bar"},
            "line": {"type": "transmission_line", "diameter": "20 mm", "length": "10 m", "mean_pressure": "20 bar",
                     "start_pressure": "20 bar", "start_flow": "18.8496 L/min", **values},
            "opening": {"output_quantity": "flow", **opening}, "valve": {"type": "signal_flow_source"},
        },
        nets={"supply": ["reservoir.port", "line.a"], "end": ["line.b", "valve.port"],
              "taken": ["opening.y", "valve.flow"]},
        fluid=TEXT | {"kinematic_viscosity": "10 cSt"},
    ).simulate(stop="60 ms")  # fmt: skip


def test_water_hammer() -> None:
    """A valve closed at 5 ms: rho a v, 11.798 bar (0.1 %: density at 20 bar), back after 2 L/a, and no ringing.

    Within friction of the line, 0.07 bar of steady drop which packs as the line fills, pressures stay between the
    reservoir's plus and minus rho a v; the front crosses the reservoir's pressure within a tick of 2 L/a.
    """
    result = hammer({"type": "step", "before": "-18.8496 L/min", "after": "0 L/min", "at": "5 ms"})
    t, p = result.time, result["end.p"]
    before = p[t < 5e-3][-1]
    rise = p[(t > 5.5e-3) & (t < 18e-3)] - before
    assert rise.min() == pytest.approx(11.798e5, rel=1.5e-3)
    assert rise.max() < 11.798e5 * 1.0015 + 0.07e5
    assert p.max() < 20e5 + 11.798e5 * 1.0015 + 0.07e5
    assert p.min() > 20e5 - 11.798e5 * 1.0015 - 0.07e5
    speed = math.sqrt(1.6e9 / (870 * math.exp(20e5 / 1.6e9)))
    fall = t[(t > 15e-3) & (p < 20e5)][0]
    assert fall == pytest.approx(5e-3 + 20.0 / speed, abs=10.0 / speed / 20)
    assert result.balance is not None
    assert max(result.balance.components.values()) < 1e-6


def test_smooth_flow_restarts_nothing() -> None:
    """With a flow that swings at 150 Hz the ends are continuous over 160 ticks: not one restart of the integrator."""
    result = hammer({"type": "sine", "amplitude": "1 L/min", "frequency": "150 Hz", "mean": "-18.8496 L/min"})
    statistics = result.trajectory.statistics
    assert statistics.ticks > 150
    assert statistics.restarts == 0
    # a quarter-wave line at 150 Hz: Z tan(omega T) times the swing, while losses are small, and the start rings on
    assert np.ptp(result["end.p"]) > 1e5


def blocked(**values: str) -> Any:
    """2 m of 10 mm bore between a source of pressure and a plug."""
    return circuit(
        components={
            "source": {"type": "pressure_source", "pressure": "0 bar"}, "plug": {"type": "plug"},
            "line": {"type": "transmission_line", "length": "2 m", "diameter": "10 mm", "mean_pressure": "0 bar",
                     **values},
        },
        nets={"start": ["source.port", "line.a"], "end": ["line.b", "plug.port"]},
        fluid=TEXT, simulation={"stop": "10 us"},
    )  # fmt: skip


def test_comes_near_its_exact_line_as_lumps_grow() -> None:
    """Error of p_b/p_a against the line's own two-port at 60, 250, 400 and 600 Hz, away from the peaks.

    At least halves as lumps double: friction's memory is of first order in the tick, all else of second. With friction
    of steady flow alone 8 % remain at 250 Hz, whatever the number of lumps.
    """
    errors = {}
    for lumps, terms in ((2, 10), (4, 10), (8, 10), (4, 0)):
        parts = blocked(lumps=str(lumps), friction_terms=str(terms))
        transfer = frequency_response(
            parts, at=parts.simulate().trajectory.end, omega=2 * np.pi * np.array([60.0, 250.0, 400.0, 600.0]),
            inputs=["source.pressure"], outputs=["end.p"], exact=True,
        ).transfers[0]  # fmt: skip
        errors[lumps, terms] = float(np.abs(transfer.value / transfer.exact - 1).max())
    assert errors[2, 10] > 2 * errors[4, 10] > 4 * errors[8, 10], errors
    assert errors[4, 0] > 0.05


def test_no_orifice_without_a_volume() -> None:
    """An end that gives its pressure answers flow at once, Z q, so an orifice on it is an algebraic loop: said so."""
    with pytest.raises(InputError, match=r"algebraic loop: .*insert a capacity"):
        circuit(
            components={
                "source": {"type": "pressure_source", "pressure": "20 bar"}, "tank": {"type": "tank"},
                "line": {"type": "transmission_line", "length": "2 m", "diameter": "10 mm", "mean_pressure": "0 bar"},
                "load": {"type": "throttle", "area": "4 mm^2"},
            },
            nets={"supply": ["source.port", "line.a"], "end": ["line.b", "load.a"], "back": ["load.b", "tank.port"]},
            fluid=TEXT,
        ).simulate(stop="1 ms")  # fmt: skip


# -- cavities at the ends ------------------------------------------------------------------------

LONG, WIDE, STOPPED = 100.0, 0.2, 5e-3
"""Length [m], diameter [m], and when the flow is stopped [s]."""


def separating(fluid: dict[str, str], flow: float, swap: bool = False) -> Any:
    """100 m of 200 mm bore from a reservoir at 0 bar; the flow [m^3/s] is stopped at once."""
    way = -1.0 if swap else 1.0
    ends = ("b", "a") if swap else ("a", "b")
    return circuit(
        components={
            "reservoir": {"type": "pressure_source", "pressure": "0 bar"},
            "line": {"type": "transmission_line", "length": f"{LONG} m", "diameter": f"{WIDE} m",
                     "mean_pressure": "0 bar", "lumps": "40", "start_flow": f"{way * flow} m^3/s"},
            "opening": {"type": "step", "output_quantity": "flow", "before": f"{-flow} m^3/s", "after": "0 L/min",
                        "at": f"{STOPPED} s"},
            "valve": {"type": "signal_flow_source"},
        },
        nets={"supply": ["reservoir.port", f"line.{ends[0]}"], "end": [f"line.{ends[1]}", "valve.port"],
              "taken": ["opening.y", "valve.flow"]},
        fluid=fluid, simulation={"stop": "900 ms"},
    )  # fmt: skip


VAPOUR = {"type": "cavitating_oil", "density": "870 kg/m^3", "kinematic_viscosity": "0.001 cSt",
          "bulk_modulus": "1.6 GPa", "vapour_pressure": "0.02 bar"}  # fmt: skip


@pytest.mark.parametrize("solver", ["lsoda", "rodas", "dopri"])
@pytest.mark.parametrize("swap", [False, True], ids=["at b", "at a"])
def test_column_separation_at_a_closed_end(solver: str, swap: bool) -> None:
    """Joukowsky, a cavity, its collapse, and a pulse above Joukowsky's: characteristics of a line without friction.

    With h = p_R - P_c and Z q_0 = 3.7 h the wave that arrives at the closed end is P_c + 4.7 h until 2 L/a after the
    stop, then P_c less 2.7 h, 0.7 h, -1.3 h, -3.3 h for 2 L/a each: w_(k+1) = 2 p_R - 2 p + w_k. The cavity grows with
    (P_c - w)/Z, is the largest, 3.4 h/Z 2 L/a, two such periods after it opened, and is gone 2.1/3.3 into the fourth.
    Then the end has P_c + 3.3 h, and from the next period on, for as long as the cavity was open in the last, P_c +
    5.3 h: more than Joukowsky's 4.7 h. Tolerances: a front takes a tick, L/(80 a), as a straight line from 4.7 h to
    -2.7 h about P_c, of whose upper part, up to 4.7^2/(2 7.4) = 1.5 h ticks, the cavity gets nothing; it comes back
    twice with each echo. So the volume is short by up to 1.5 (1 + 2) ticks h/Z at its largest, and by 1.5 (1 + 3 2)
    before the collapse, which makes it 3.2 ticks early. Friction of the smooth bore at 0.3 m/s, f rho v^2 L/(2 d) with
    f = 0.004, is 0.08 kPa, 1e-3 of h. Wylie & Streeter (1993), on column separation and the short pulse after it.
    """
    h = 1.01325e5 - 2e3
    Z = 870 * WAVE / (math.pi / 4 * WIDE**2)
    result = separating(VAPOUR, 3.7 * h / Z, swap).simulate(solver=solver)
    t, p, name = result.time, result["end.p"], "a" if swap else "b"
    volume = result[f"line.cavity_{name}"]
    period, tick = 2 * LONG / WAVE, LONG / WAVE / 80
    least = 2e3 - 1.01325e5
    collapse = 4 + 2.1 / 3.3
    plateaus = [(0, 1, 4.7), (1, collapse, 0.0), (collapse, 5, 3.3), (5, 1 + collapse, 5.3)]
    assert p.min() >= least - 1.0
    for begin, end, level in plateaus:
        inside = (t > STOPPED + begin * period + 2 * tick) & (t < STOPPED + end * period - 5 * tick)
        assert inside.sum() > 5
        assert np.abs(p[inside] - least - level * h).max() < 0.02 * h, (begin, end)
    assert volume.max() == pytest.approx(3.4 * h / Z * period, abs=4.5 * tick * h / Z)
    assert t[np.argmax(volume)] == pytest.approx(STOPPED + 3 * period, abs=tick)
    (opened,) = [e.time for e in result.trajectory.happenings if f"line.opens_{name}" in e.names][:1]
    (closed,) = [e.time for e in result.trajectory.happenings if f"line.closes_{name}" in e.names][:1]
    assert opened == pytest.approx(STOPPED + period, abs=tick)
    assert closed == pytest.approx(STOPPED + collapse * period, abs=4.2 * tick)
    assert result.balance is not None
    assert max(result.balance.components.values()) < 1e-5


@pytest.mark.parametrize("solver", ["lsoda", "rodas"])
def test_without_vapour_the_run_ends(solver: str) -> None:
    """A fluid without vapour cannot part: the run ends when the trough arrives, 2 L/a after the stop, and says why.

    A tick of L/(80 a), over which a front rises, is what the instant is known to. Under tension it goes on, as far
    below as Joukowsky says.
    """
    flow = 3.7 * 1e5 / (870 * WAVE / (math.pi / 4 * WIDE**2))
    with pytest.raises(SimulationError, match=r"line: its end b is below absolute zero.*cavitating_oil") as failure:
        separating(TEXT, flow).simulate(solver=solver)
    result = failure.value.result  # type: ignore[attr-defined]
    assert result.time[-1] == pytest.approx(STOPPED + 2 * LONG / WAVE, abs=LONG / WAVE / 80)
    assert result["end.p"].min() >= -1.01326e5
    tense = separating({**TEXT, "tension": "true"}, flow).simulate(solver=solver)
    assert tense["end.p"].min() == pytest.approx(-3.7e5, rel=0.02)


# -- what `check` says ---------------------------------------------------------------------------

AERATED = {"type": "aerated_oil", "density": "870 kg/m^3", "kinematic_viscosity": "46 cSt", "bulk_modulus": "1.6 GPa",
           "air_fraction": "0.5 %", "saturation_pressure": "1000 bar"}  # fmt: skip


def remarks_in(fluid: dict[str, str]) -> list[str]:
    """What `check` adds on a line of 200 bar in this fluid."""
    parts = {
        "source": {"type": "pressure_source", "pressure": "200 bar"},
        "line": {"type": "transmission_line", "length": "10 m", "diameter": "10 mm", "mean_pressure": "200 bar"},
        "end": {"type": "plug"},
    }
    nets = {"n1": ["source.port", "line.a"], "n2": ["line.b", "end.port"]}
    said: list[str] = facts(circuit(components=parts, nets=nets, fluid=fluid).system().plan)["remarks"]
    return said


def test_check_tells_of_a_wave_speed_that_varies() -> None:
    """At 0 bar gauge by hand: rho = 0.995 870, beta = 1/((1 - alpha)/beta_l + alpha (1/(n P) + 1/(P_s - P))).

    a = sqrt(beta/rho): isothermal-to-adiabatic free air (n = 1.4) in a liquid, Wood's formula.
    """
    P, alpha = 101325.0, 0.005
    beta = 1 / ((1 - alpha) / 1.6e9 + alpha * (1 / (1.4 * P) + 1 / (1000e5 - P)))
    (said,) = remarks_in(AERATED)
    assert said.startswith("line: its waves run at ")
    assert "mean_pressure of 200 bar" in said
    assert "lax_wendroff_line" in said
    slow = re.search(r"they run at ([\d.]+) m/s at 0 bar", said)
    assert slow is not None
    assert float(slow[1]) == pytest.approx(math.sqrt(beta / (0.995 * 870)), rel=2e-3)


def test_check_tells_that_cavities_inside_the_line_are_left_out() -> None:
    """Vapour pressure 0.1 bar absolute is 0.1 - 1.01325 bar gauge; without vapour and air there is nothing to tell."""
    evaporating = TEXT | {"type": "cavitating_oil", "vapour_pressure": "0.1 bar"}
    (said,) = remarks_in(evaporating)
    assert "evaporates at -0.9133 bar" in said
    assert "cavities inside the line are left out" in said
    assert len(remarks_in(evaporating | {"air_fraction": "0.5 %", "saturation_pressure": "1000 bar"})) == 2
    assert remarks_in(TEXT) == []
