"""The examination of a circuit: modes, what limits the step, events and energy, against closed forms."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from building import OIL, alone, circuit

import crescentlab as cl
from crescentlab import compiler
from crescentlab.analysis.doctor import advice, bound_of, examine, mode_text, time_text
from crescentlab.analysis.doctor.activity import activities, indices
from crescentlab.analysis.doctor.run_modes import run_modes
from crescentlab.analysis.linear.modes import Mode
from crescentlab.circuit import Circuit
from crescentlab.cli import main
from crescentlab.component import Component, Equations
from crescentlab.domain import state
from crescentlab.errors import InputError
from crescentlab.maths import Expr, cos, when
from crescentlab.units import Pressure, Ratio

BETA, RHO, NU = 1.4e9, 860.0, 35e-6
"""Bulk modulus [Pa], density [kg/m^3] and viscosity [m^2/s] of the test's oil."""
LEAK = {"type": "annular_gap", "diameter": "10 mm", "clearance": "50 um", "length": "10 mm"}
CONDUCTANCE = np.pi * 10e-3 * (50e-6) ** 3 / (12 * RHO * NU * 10e-3)
"""Of the gap, pi D h^3/(12 mu L) [m^3/(s Pa)]."""


class Chain(Component):
    """x drives y and both decay, y swings with z; w only counts: eigenvalues -1000, -5 +- 200 j, 0."""

    x = state(Ratio, "drives", start=1.0)
    y = state(Ratio, "is driven", start=1.0)
    z = state(Ratio, "swings with y")
    w = state(Ratio, "counts")

    def equations(self, x: Expr, y: Expr, z: Expr) -> Equations:
        return {"der_x": -1000.0 * x, "der_y": x - 10.0 * y - 200.0 * z, "der_z": 200.0 * y, "der_w": x + y}


class Sawtooth(Component):
    """z rises by 100 a second and falls by 1 whenever it reaches 1."""

    z = state(Ratio, "sawtooth", start=0.0)

    def equations(self, z: Expr) -> Equations:
        return {"der_z": 100.0, "falls": when(z >= 1.0, z=z - 1.0)}


class TwoLags(Component):
    """Two lags of 1 us and 10 ms, the first behind a slow cosine."""

    fast = state(Pressure, "fast", start=1e5, nominal=1e5)
    slow = state(Pressure, "slow", start=1e5, nominal=1e5)

    def equations(self, fast: Expr, slow: Expr, t: Expr) -> Equations:
        return {"der_fast": 1e6 * (1e5 * cos(100 * t) - fast), "der_slow": 100.0 * (fast - slow)}


def volumes(*sizes: str, solver: str = "auto") -> Circuit:
    """Volumes that empty through equal gaps, each by itself."""
    parts: dict[str, dict[str, object]] = {"tank": {"type": "tank"}}
    nets: dict[str, list[str]] = {"t": ["tank.port"]}
    for k, size in enumerate(sizes):
        parts[f"v{k}"] = {"type": "capacity", "volume": size, "start": {"p": "5 bar"}}
        parts[f"gap{k}"] = LEAK
        nets[f"p{k}"] = [f"v{k}.port", f"gap{k}.a"]
        nets["t"].append(f"gap{k}.b")
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "10 ms", "solver": solver})


# -- modes ---------------------------------------------------------------------------------------


def test_modes_of_volumes_with_gaps_are_their_rc() -> None:
    """s = -G beta/V of a volume behind a laminar gap, so two volumes of 1 and 50 cm^3 have a stiffness of 50.

    The density ratio in G and beta/V moves by p/beta = 4e-4 at 5 bar.
    """
    found = examine(volumes("1 cm^3", "50 cm^3"))
    at = found.instants[-1]
    fast, slow = (at.mode(int(k)) for k in at.by_speed)
    assert fast.eigenvalue == pytest.approx(-CONDUCTANCE * BETA / 1e-6, rel=2e-3)
    assert slow.eigenvalue == pytest.approx(-CONDUCTANCE * BETA / 50e-6, rel=2e-3)
    assert at.stiffness == pytest.approx(50, rel=2e-3)
    assert fast.participation == {"v0.p": 1.0}
    assert slow.participation == {"v1.p": 1.0}


def test_modes_of_a_chain_are_those_of_its_blocks() -> None:
    """Eigenvalues of a block-triangular matrix are those of its blocks; an integrator is an exact zero, and left out.

    lambda^2 + 10 lambda + 200^2 = 0 for y and z, which take part by half each (|w_k v_k| of a 2 x 2 block).
    """
    result = alone(Chain, simulation={"stop": "1 ms"}).simulate(solver="rodas")
    t, x, h, b = result.trajectory.steps.arrays()
    found = run_modes(result.system, result.values, float(t[0]), x[0], h[0], b[0])
    first, second = (found.mode(int(k)) for k in found.by_speed)
    assert first.eigenvalue == pytest.approx(-1000, rel=1e-12)
    assert first.participation == {"part.x": 1.0}
    assert second.eigenvalue == pytest.approx(complex(-5, np.sqrt(200**2 - 25)), rel=1e-12)
    assert second.damping_ratio == pytest.approx(5 / 200, rel=1e-12)
    assert second.participation == pytest.approx({"part.y": 0.5, "part.z": 0.5}, rel=1e-3)
    assert found.stiffness == pytest.approx(5, rel=1e-12)
    assert found.of_state(3) is None  # it only counts
    at_y = found.of_state(1)
    assert at_y is not None
    assert at_y.eigenvalue == second.eigenvalue


def test_modes_in_words() -> None:
    assert mode_text(Mode(complex(-2 * np.pi * 63, 2 * np.pi * 2099.05), {})) == "a mode at 2.1 kHz, damping 0.03"
    assert mode_text(Mode(-1e5 + 0j, {})) == "a decay of time constant 10 us"
    assert mode_text(Mode(1e5 + 0j, {})) == "a growth of time constant 10 us"
    assert [time_text(t) for t in (0.0, 2.0, 3e-3, 4e-9)] == ["0 s", "2 s", "3 ms", "4 ns"]


# -- steps and events ----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["rodas", "dopri"])
def test_every_tried_step_counts_one_state(solver: str) -> None:
    """Each tried step has one largest error; steps searched for an event are tried several times."""
    result = cl.load("relief_valve").simulate(solver=solver)
    s = result.trajectory.statistics
    assert s.limited is not None
    assert s.limited.shape == (3,)
    assert s.limited.sum() >= s.steps + s.rejected
    smooth = alone(TwoLags, simulation={"stop": "20 ms"}).simulate(solver=solver).trajectory.statistics
    assert smooth.limited is not None
    assert smooth.limited.sum() == smooth.steps + smooth.rejected


def test_the_state_that_moves_limits_the_step() -> None:
    """A volume that is full already has no error, one that empties has all of it."""
    parts = {
        "still": {"type": "capacity", "volume": "1 cm^3"},
        "plug": {"type": "plug"},
        "moving": {"type": "capacity", "volume": "1 cm^3", "start": {"p": "5 bar"}},
        "gap": LEAK,
        "tank": {"type": "tank"},
    }
    nets = {"a": ["still.port", "plug.port"], "b": ["moving.port", "gap.a"], "t": ["tank.port", "gap.b"]}
    found = examine(circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "1 ms"}))
    assert found.limits is not None
    assert [(limit.state, limit.share) for limit in found.limits] == [("moving.p", 1.0)]
    mode = found.limits[0].mode
    assert mode is not None
    assert mode.eigenvalue == pytest.approx(-CONDUCTANCE * BETA / 1e-6, rel=2e-3)
    assert (
        "moving.p limited 100 % of the steps; its part in the circuit is a decay of time constant" in advice(found)[0]
    )


def test_stiffness_is_told_by_the_steps_of_an_explicit_method() -> None:
    """|s| T/2.2 = 1e6/s 0.1 s/2.2 steps: RK45 is stable up to 3.3 on the real axis, and kept well inside, at 2.2."""
    lags = alone(TwoLags, simulation={"stop": "100 ms", "rtol": "1e-4"})
    found = examine(lags)
    assert found.explicit_steps == pytest.approx(1e6 * 0.1 / 2.2, rel=1e-6)
    assert found.stiff
    assert "where rodas took" in " ".join(advice(found))
    assert "--solver radau or lsoda as well" in " ".join(advice(found)), "not the one in use"
    taken = lags.simulate(solver="rk45").trajectory.statistics.steps
    assert taken == pytest.approx(found.explicit_steps, rel=0.1)
    calm = examine(volumes("1 cm^3"), stop="1 ms")
    assert not calm.stiff
    assert "--solver dopri may be faster" in " ".join(advice(calm))


def test_advice_names_no_solver_in_use() -> None:
    """Neither that of the examination nor that of the circuit."""
    stiff = alone(TwoLags, simulation={"stop": "100 ms", "rtol": "1e-4", "solver": "radau"})
    said = " ".join(advice(examine(stiff)))
    assert "--solver lsoda as well" in said
    assert "--solver rodas" not in said
    calm = volumes("1 cm^3", solver="dopri")
    assert "--solver" not in " ".join(advice(examine(calm, stop="1 ms")))


def test_what_a_lift_is_about_is_not_to_be_left_out() -> None:
    """10 kN pull a mass at 1 m/s against a damper: nothing stays in it, 10 kN 1 m/s 10 ms = 100 J pass there.

    Another mass, 1 g at 1 m/s on a spring of 1 N/m: m v^2/2 sin^2(omega t) = 0.05 mJ pass, and whether it is needed may
    be asked.
    """
    parts = {"load": {"type": "mass", "mass": "1 kg", "start": {"v": "1 m/s"}},
             "pull": {"type": "force_source", "force": "10 kN"},
             "brake": {"type": "damper", "coefficient": "10 kN s/m"},
             "other": {"type": "mass", "mass": "1 g", "start": {"v": "1 m/s"}},
             "spring": {"type": "spring", "stiffness": "1 N/m"}}  # fmt: skip
    nets = {"lift": ["load.port", "pull.rod", "brake.rod"], "shaken": ["other.port", "spring.rod"]}
    found = examine(circuit(components=parts, nets=nets, simulation={"stop": "10 ms"}))
    assert found.index["load"] < 1e-9
    assert found.passed_on["load"] == pytest.approx(100, rel=1e-6)
    assert found.passed_on["other"] == pytest.approx(0.5e-3 * np.sin(np.sqrt(1e3) * 10e-3) ** 2, rel=1e-4)
    assert not found.without_part("load")
    assert found.without_part("other")


def bouncing() -> Circuit:
    """A mass that falls 5 mm under 1 g and rebounds with 0.5."""
    mass = {"type": "mass_with_stops", "mass": "1 kg", "high": "1 m", "restitution": "0.5", "rest_speed": "1 mm/s",
            "start": {"x": "5 mm"}}  # fmt: skip
    parts = {"ball": mass, "weight": {"type": "force_source", "force": "-9.81 N"}}
    return circuit(components=parts, nets={"n": ["ball.port", "weight.rod"]}, simulation={"stop": "200 ms"})


def test_impacts_are_counted() -> None:
    """Rebounds at v_k = 0.5^k sqrt(2 g h): the first below 1 mm/s is the ninth, 0.61 mm/s, and ends at rest."""
    found = examine(bouncing())
    speeds = np.sqrt(2 * 9.81 * 5e-3) * 0.5 ** np.arange(1, 12)
    impacts = int(np.argmax(speeds <= 1e-3)) + 1
    assert impacts == 9
    assert found.happened["ball"] == {"hits_low": impacts, "starts": 1}
    assert not any("events rule the run" in sentence for sentence in advice(found))


def test_events_that_rule_a_run_are_named() -> None:
    """A sawtooth of 10 ms falls 99 times before 1 s, and each fall restarts the integration."""
    found = examine(alone(Sawtooth, simulation={"stop": "995 ms"}))
    assert found.happened == {"part": {"falls": 99}}
    assert found.result.trajectory.statistics.restarts == 99
    assert any("part.falls happens most, 99 times" in sentence for sentence in advice(found))


def test_ticks_are_counted_and_held_values_named() -> None:
    """The line of a pump test ticks at 0.9 dx/a; its nodes have no modes in the Jacobian."""
    found = examine(cl.load("crescent_pump"), stop="5 ms", rtol=1e-3)
    ticks = found.result.trajectory.statistics.ticks
    assert found.happened["line.pipe"] == {"tick": ticks}
    assert set(found.ticking) == {"line.pipe"}
    pipe = next(line for line in found.lines if line.name == "line.pipe")
    assert pipe.errors.size == pipe.frequencies.size > 0
    assert pipe.frequencies.max() <= 0.25 * ticks / found.span * (1 + 1 / ticks)  # a quarter of the tick rate
    assert found.activity["gears"] < 1e-9 * found.activity["shaft"]  # it hands on what it takes


# -- energy --------------------------------------------------------------------------------------


def test_an_orifice_turns_all_that_the_source_gives_into_heat() -> None:
    """A = p q t of both (Louca et al. 1997): a constant flow through an orifice whose pressure has settled."""
    parts = {
        "pump": {"type": "flow_source", "flow": "20 L/min"},
        "line": {"type": "capacity", "volume": "1 cm^3", "start": {"p": "2.4379 bar"}},
        "hole": {"type": "throttle", "area": "20 mm^2"},
        "tank": {"type": "tank"},
    }
    nets = {"p": ["pump.port", "line.port", "hole.a"], "t": ["hole.b", "tank.port"]}
    bench = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "100 ms"})
    rest = bench.simulate(solver="rodas", rtol=1e-10)["line.p"][-1]
    result = bench.simulate(parameters={"line.start.p": f"{float(rest)!r} Pa"}, solver="rodas", rtol=1e-10)
    found = activities(result)
    assert found["pump"] == pytest.approx(rest * 20e-3 / 60 * 0.1, rel=1e-9)
    assert found["hole"] == pytest.approx(rest * 20e-3 / 60 * 0.1, rel=1e-6)
    assert found["line"] < 1e-6 * found["hole"]
    shares = indices(found)
    assert sum(shares.values()) == pytest.approx(1, rel=1e-12)
    assert shares["hole"] == pytest.approx(0.5, rel=1e-6)


def test_a_volume_that_empties_gives_what_the_gap_takes() -> None:
    """Of an oil of constant bulk modulus: integral p q dt from 5 bar to nearly 0 is p^2 V/(2 beta), both ways."""
    result = volumes("1 cm^3").simulate("50 ms", solver="rodas", rtol=1e-9)
    found = activities(result)
    assert found["v0"] == pytest.approx((5e5) ** 2 * 1e-6 / (2 * BETA), rel=1e-3)  # p/beta = 4e-4
    assert found["gap0"] == pytest.approx(found["v0"], rel=1e-9)
    assert indices(found) == pytest.approx({"v0": 0.5, "gap0": 0.5, "tank": 0.0}, abs=1e-9)


def test_a_spring_and_its_mass_exchange_energy() -> None:
    """x = X cos(w t): |k x v| and |m v dv/dt| integrate to 4 (k X^2/2) over a period, the force source gives none."""
    parts = {
        "mass": {"type": "mass_with_stops", "mass": "1 kg", "low": "-1 m", "high": "1 m", "start": {"x": "10 mm"}},
        "spring": {"type": "spring", "stiffness": "1000 N/m"},
    }
    period = 2 * np.pi / np.sqrt(1000)
    bench = circuit(components=parts, nets={"n": ["mass.port", "spring.rod"]})
    found = activities(bench.simulate(period, solver="rodas", rtol=1e-9))
    assert found["spring"] == pytest.approx(4 * 1000 * 1e-4 / 2, rel=1e-3)  # its sign changes inside four steps
    assert found["mass"] == pytest.approx(found["spring"], rel=1e-9)


# -- the command ---------------------------------------------------------------------------------


def test_the_command_prints_every_part(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "relief_valve", "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert main(["doctor", "relief_valve"]) == 0
    out = capsys.readouterr().out
    for part in ("modes at the end", "limited", "happened", "activity", "valve.spool", "starts 1, leaves 1", "  - "):
        assert part in out


def test_the_command_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "relief_valve", "--json", "--stop", "10 ms"]) == 0
    found = json.loads(capsys.readouterr().out, parse_constant=lambda word: pytest.fail(word))
    assert found["status"] == "done"
    assert found["error"] is None
    assert sum(found["activity_index"].values()) == pytest.approx(1)
    assert {limit["state"] for limit in found["limits"]} <= set(cl.load("relief_valve").system().state_names)
    assert len(found["instants"]) == 5
    assert found["span"] == pytest.approx(0.01)


def test_without_a_compiler_it_says_what_it_cannot_tell(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(compiler, "command", lambda: ())
    from crescentlab.solvers import native

    native.library.cache_clear()
    monkeypatch.setenv("CRESCENTLAB_CACHE", str(Path("/nonexistent") / "cache"))
    try:
        assert main(["doctor", "relief_valve"]) == 0
    finally:
        native.library.cache_clear()
    out = capsys.readouterr().out
    assert "which state limited the steps is not known" in out
    assert "rodas needs a C compiler" in out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--line-error", "5"], "write for example '5 %'"),
        (["--line-error", "5 bar"], "--line-error: '5 bar'"),
        (["--stop", "-1 ms"], "stop: -1 ms must be above 0"),
        (["--period", "3 bar"], "period:"),
    ],
)
def test_wrong_options_are_told_in_one_sentence(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "relief_valve", *arguments]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_the_bound_is_a_ratio() -> None:
    assert bound_of("5 %") == pytest.approx(0.05)
    with pytest.raises(InputError, match="between 0 and 200 %"):
        bound_of("0")


def test_what_is_fast_at_the_start_alone_makes_no_circuit_stiff():
    """An orifice at zero drop is laminar and fast; within microseconds it is not, and dopri takes few steps."""
    oil = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"}
    bench = circuit(
        components={
            "pump": {"type": "flow_source", "flow": "10 L/min"}, "line": {"type": "capacity", "volume": "100 cm^3"},
            "hole": {"type": "orifice", "area": "3 mm^2", "lambda_c": "1"}, "tank": {"type": "tank"},
        },
        nets={"p": ["pump.port", "line.port", "hole.a"], "t": ["hole.b", "tank.port"]},
        fluid=oil, simulation={"stop": "200 ms"},
    )  # fmt: skip
    found = examine(bench)
    assert found.instants[0].fastest > 100 * found.instants[-1].fastest
    assert not found.stiff
    steps = bench.simulate(solver="dopri").trajectory.statistics.steps
    assert found.explicit_steps < 2 * steps
