"""The ledger of energy: of runs against closed forms, and of every shipped circuit against itself."""

from __future__ import annotations

import json
import math
import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

import crescentlab as cl
from crescentlab.balance import EnergyBalance
from crescentlab.cli import main
from crescentlab.errors import ComponentError

BAR = 1e5
OIL = "{type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"
RHO, BETA = 860.0, 1.4e9
TIGHT = {"solver": "radau", "rtol": 1e-9}


def circuit(folder: Path, text: str) -> cl.Circuit:
    """The circuit of a text written in a test."""
    (folder / "bench.yaml").write_text("crescentlab: 1\n" + textwrap.dedent(text), encoding="utf-8")
    return cl.load(folder / "bench.yaml")


def held(volume: float, p: float) -> float:
    """Energy [J] in a volume of oil: V rho times the integral of p drho/rho^2 is V (beta (e^{p/beta} - 1) - p)."""
    return volume * (BETA * math.expm1(p / BETA) - p)


def energy(result: cl.Result) -> EnergyBalance:
    """The ledger of energy of a run."""
    assert result.balance is not None
    assert result.balance.energy is not None
    return result.balance.energy


def closes(books: EnergyBalance, share: float, exchanged: float = 0.0) -> bool:
    """Whether every component and the circuit close, and the totals with them; ``exchanged`` [J] stayed inside."""
    missing = (
        sum(books.supplied.values()) - sum(books.dissipated.values()) - books.stored + sum(books.at_events.values())
    )
    missing -= sum(books.silent.values())
    size = max(exchanged, abs(sum(books.supplied.values())), sum(books.dissipated.values()), abs(books.stored))
    return max(books.circuit, *books.components.values()) < share and abs(missing) < 10 * share * size


def test_two_volumes_lose_what_they_no_longer_hold(tmp_path: Path) -> None:
    """300 and 0 bar in 70 cm^3 each end at one pressure, by mass; the difference of energies heats the orifice."""
    run = circuit(tmp_path, f"""
        fluid: {OIL}
        components:
          one: {{type: capacity, volume: 70 cm^3, start: {{p: 300 bar}}}}
          hole: {{type: orifice, area: 5 mm^2}}
          other: {{type: capacity, volume: 70 cm^3}}
        nets: {{high: [one.port, hole.a], low: [hole.b, other.port]}}
        simulation: {{stop: 100 ms}}
        """).simulate(**TIGHT)  # fmt: skip
    level = BETA * math.log((math.exp(300 * BAR / BETA) + 1) / 2)
    lost = held(70e-6, 300 * BAR) - 2 * held(70e-6, level)
    books = energy(run)
    assert run["one.p"][-1] == pytest.approx(level, rel=1e-6)
    assert books.dissipated == {"hole": pytest.approx(lost, rel=1e-6)}
    assert books.stored == pytest.approx(-lost, rel=1e-6)
    assert books.supplied == {}
    assert closes(books, 1e-6)


def test_an_impact_loses_its_share_of_the_motion(tmp_path: Path) -> None:
    """A mass against a spring and a stop, restitution e: the impact leaves e^2 of its energy, booked at the event."""
    run = circuit(tmp_path, """
        components:
          mass: {type: mass_with_stops, mass: 2 kg, low: -1 m, high: 50 mm, restitution: 0.5,
                 start: {x: 0 mm, v: 3 m/s}}
          spring: {type: spring, stiffness: 2000 N/m}
        nets: {rod: [mass.port, spring.rod]}
        simulation: {stop: 60 ms}
        """).simulate(**TIGHT)  # fmt: skip
    arriving = 2 * 3**2 / 2 - 2000 * 0.05**2 / 2
    books = energy(run)
    assert books.at_events["mass"] == pytest.approx(-(1 - 0.5**2) * arriving, rel=1e-6)
    assert run["mass.kinetic_energy"][-1] + run["spring.stored_energy"][-1] == pytest.approx(
        9 + books.at_events["mass"]
    )
    assert closes(books, 1e-6)


def test_friction_takes_all_of_a_slide(tmp_path: Path) -> None:
    """A mass thrown with v0 slides m v0^2/(2 F_c) and sticks: its friction has taken m v0^2/2."""
    run = circuit(tmp_path, """
        components:
          sledge: {type: stick_slip_mass, mass: 5 kg, coulomb_friction: 20 N, static_friction: 25 N, start: {v: 2 m/s}}
        nets: {body: [sledge.port]}
        simulation: {stop: 1 s}
        """).simulate(**TIGHT)  # fmt: skip
    assert run["sledge.x"][-1] == pytest.approx(5 * 2**2 / 2 / 20)
    assert energy(run).dissipated["sledge"] == pytest.approx(5 * 2**2 / 2, rel=1e-6)
    assert closes(energy(run), 1e-6)


def test_a_piston_turns_motion_into_compression(tmp_path: Path) -> None:
    """A mass runs a piston into a closed chamber: where it turns, the oil holds all of m v0^2/2."""
    run = circuit(tmp_path, f"""
        fluid: {OIL}
        components:
          mass: {{type: mass, mass: 10 kg, start: {{v: -1 m/s}}}}
          piston: {{type: piston_chamber, diameter: 40 mm, dead_volume: 100 cm^3}}
          oil: {{type: variable_capacity}}
        nets: {{rod: [mass.port, piston.rod], chamber: [piston.chamber, oil.chamber], end: [oil.port]}}
        simulation: {{stop: 10 ms, stop_when: mass.v > 0 m/s}}
        """).simulate(**TIGHT)  # fmt: skip
    assert run["oil.stored_energy"][-1] == pytest.approx(10 * 1**2 / 2, rel=1e-6)
    assert closes(energy(run), 1e-6, exchanged=5.0)


@pytest.mark.parametrize("name", ["accumulator", "counterbalanced_load", "external_gear_pump", "position_servo"])
def test_shipped_circuits_close(name: str) -> None:
    """Compressible parts, events, ticks, gas, loads: the ledger closes below 1e-6 as the circuit is shipped."""
    assert closes(energy(cl.load(name).simulate()), 1e-6)


def test_the_crescent_pump_keeps_books() -> None:
    """All but the Lax-Wendroff line: shaft power becomes heat in gaps and throttle, or goes into the line."""
    books = energy(cl.load("crescent_pump").simulate(stop="20 ms"))
    assert list(books.silent) == ["line.pipe"]
    assert books.silent["line.pipe"] > 0
    assert closes(books, 1e-6)
    assert sum(books.dissipated.values()) > 0


def test_a_part_without_books_is_named(tmp_path: Path) -> None:
    """A user's component through which power passes, and which says nothing: named, and the others still close."""
    (tmp_path / "mine.py").write_text('''
from pydantic import Field
from crescentlab.component import Component, Equations
from crescentlab.domain import takes_pressure
from crescentlab.units import FlowConductance

class Leak(Component):
    """Leak q = G (p_a - p_b)."""
    conductance: FlowConductance = Field(gt=0, description="flow per pressure drop")
    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    def equations(self, p_a, p_b) -> Equations:
        q = self.conductance * (p_a - p_b)
        return {"q_a": q, "q_b": -q}
''', encoding="utf-8")  # fmt: skip
    text = f"""
        fluid: {OIL}
        library: [./mine.py]
        components:
          one: {{type: capacity, volume: 70 cm^3, start: {{p: 300 bar}}}}
          hole: {{type: leak, conductance: 1e-12 m^3/(s Pa)}}
          tank: {{type: tank}}
        nets: {{high: [one.port, hole.a], low: [hole.b, tank.port]}}
        simulation: {{stop: 100 ms}}
        """
    books = energy(circuit(tmp_path, text).simulate(**TIGHT))
    assert books.silent == {"hole": pytest.approx(-books.stored, rel=1e-6)}
    assert closes(books, 1e-6)


def test_without_a_fluid_power_is_p_times_q(tmp_path: Path) -> None:
    """A circuit that names no fluid knows no density: 20 bar times 6 L/min are 200 W."""
    run = circuit(tmp_path, """
        components:
          source: {type: pressure_source, pressure: 20 bar}
          plug: {type: flow_source, flow: -6 L/min}
          mass: {type: mass, mass: 1 kg}
        nets: {line: [source.port, plug.port], body: [mass.port]}
        simulation: {stop: 1 s}
        """).simulate()  # fmt: skip
    assert run["source.supply"][-1] == pytest.approx(200.0)
    assert run["plug.supply"][-1] == pytest.approx(-200.0)


def test_the_summary_and_json_show_the_energy(capsys: pytest.CaptureFixture[str]) -> None:
    """What a user sees of a relief valve: all that is supplied becomes heat, but for what the line now holds."""
    assert main(["simulate", "relief_valve", "-o", "none"]) == 0
    said = capsys.readouterr().out
    page = (Path(__file__).parents[1] / "docs" / "balances.md").read_text(encoding="utf-8")
    shown = [line for line in page.splitlines() if line.startswith(("  energy ", "  heat "))]
    assert len(shown) == 2
    assert all(line in said for line in shown)
    assert main(["simulate", "relief_valve", "-o", "none", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["balance"]["energy"]
    assert set(found) == {"circuit", "components", "supplied", "dissipated", "stored", "at_events", "silent"}
    assert sum(found["supplied"].values()) == pytest.approx(
        sum(found["dissipated"].values()) + found["stored"], rel=1e-6
    )


def test_losses_are_variables_like_others() -> None:
    """The power lost in the relief valve is its drop times its flow, to the oil's compression, p/(2 beta)."""
    run = cl.load("relief_valve").simulate()
    drop, flow, loss = run["p_line.p"], run["valve.q"], run["valve.holes.loss"]
    late = run.time > 0.02
    assert np.allclose(loss[late], (drop * flow)[late], rtol=1e-2)


def test_a_store_that_does_not_say_what_it_loses_is_refused() -> None:
    """With stored energy, what is lost cannot be told from what is stored: equations must return it."""
    from crescentlab.component import Component, Equations, check_returned
    from crescentlab.domain import dissipates, gives_motion, state, stores_energy
    from crescentlab.units import Length, Velocity

    class Sloppy(Component):
        port = gives_motion("the mass")
        x = state(Length, "position")
        v = state(Velocity, "velocity")
        kinetic_energy = stores_energy()
        loss = dissipates()

        def equations(self, x: float, v: float, f_port: float) -> Equations:
            return {"x_port": x, "v_port": v, "der_x": v, "der_v": f_port, "kinetic_energy": v * v / 2}

    with pytest.raises(ComponentError, match="does not return loss"):
        check_returned(Sloppy, Sloppy().equations(0.0, 1.0, 0.0))


WRONG = '''
from pydantic import Field
from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, takes_pressure
from crescentlab.units import FlowConductance

class Leak(Component):
    """Leak q = G (p_a - p_b)."""
    conductance: FlowConductance = Field(description="flow per pressure drop")
    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    loss = dissipates()
    def equations(self, p_a, p_b) -> Equations:
        q = self.conductance * (p_a - p_b)
        return {"q_a": q, "q_b": -SHARE * q}
'''


@pytest.mark.parametrize(
    ("share", "conductance", "told"),
    [
        (
            "0.5",
            "1e-12",
            r"hole: .* cm3 more entered than left; in its equations the flows at its ports must add up to 0",
        ),
        ("1", "-1e-12", "hole: its loss is negative; check the signs of its flows, forces and torques"),
    ],
)
def test_a_component_that_makes_fluid_or_energy_is_warned_of(
    share: str, conductance: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half of what enters vanishes; or everything flows uphill. The volumes' own ledgers close all the same."""
    (tmp_path / "mine.py").write_text(WRONG.replace("SHARE", share), encoding="utf-8")
    bench = circuit(tmp_path, f"""
        fluid: {OIL}
        library: [./mine.py]
        components:
          one: {{type: capacity, volume: 70 cm^3, start: {{p: 50 bar}}}}
          hole: {{type: leak, conductance: {conductance} m^3/(s Pa)}}
          other: {{type: capacity, volume: 70 cm^3}}
        nets: {{high: [one.port, hole.a], low: [hole.b, other.port]}}
        simulation: {{stop: 0.5 ms}}
        """)  # fmt: skip
    balance = bench.simulate().balance
    assert balance is not None
    assert max(balance.components.values()) < 1e-3
    (warning,) = balance.warnings
    assert re.match(told, warning)
    assert main(["simulate", str(tmp_path / "bench.yaml"), "-o", "none"]) == 0
    assert f"warning: {warning}" in capsys.readouterr().out


def test_what_drives_and_what_brakes_are_told_apart() -> None:
    """A pump's drive supplies, a weight that is lifted takes out; each stands under its own name."""
    books = energy(cl.load("hydrostatic_transmission").simulate())
    assert {name for name, joules in books.supplied.items() if joules > 0} == {"engine"}
    assert all(joules < 0 for name, joules in books.supplied.items() if name != "engine")


def test_the_page_of_lines_shows_what_its_circuit_gives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The flow stopped at the end of a line, as docs/lines.md has it: the energy in its summary is the printed one."""
    page = (Path(__file__).parents[1] / "docs" / "lines.md").read_text(encoding="utf-8")
    text = page.partition("# file: stopped_flow.yaml\n")[2].partition("```")[0]
    (tmp_path / "stopped_flow.yaml").write_text(text, encoding="utf-8")
    command = ["simulate", str(tmp_path / "stopped_flow.yaml"), "--solver", "rodas", "--rtol", "1e-7", "-o", "none"]
    assert main(command) == 0
    (shown,) = [line for line in page.splitlines() if line.startswith("  energy ")]
    assert shown in capsys.readouterr().out
