"""Random circuits of the whole library: every solver gives what the reference gives, and the same events.

``make test`` runs 60 small ones, ``make campaign`` 2000 of 3 to 60 parts. A failure prints the seed, the types and the
circuit; it becomes a fixed case below.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import yaml
from agreement import Reference, run
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import seed as seeded
from hypothesis import strategies as st
from random_circuits import LEFT_OUT, circuit_data, drawn, library, yaml_text

from crescentlab.circuit import Circuit
from crescentlab.errors import InputError
from crescentlab.netlist import Netlist
from crescentlab.solvers.functions import Functions

RTOL = 1e-6
MULTIPLE = {
    "rodas": 100, "radau": 100, "lsoda": 500, "auto": 500, "dopri": 100, "rk45": 100, "dop853": 100, "bdf": 100,
    "cvode": 1000,
}  # fmt: skip
"""How far a solver's run may be from the reference, in tolerances; stated in docs/solvers.md."""
EXPLICIT = ("dopri", "rk45", "dop853")
FEW = 1_000
"""Steps that stiffness may ask of an explicit method in the suite; a stiffer circuit is left to the others."""
MANY = 100_000
"""The same of dopri in the campaign; SciPy's take a twentieth."""
TOLD = "the errors there add up beyond the tolerance"
"""What a method with memory says of a run with many restarts, which it does not hold."""
BLOCKS, PER_BLOCK = 40, 50


def types(least: int, most: int) -> st.SearchStrategy[list[str]]:
    """Types that a circuit is to hold; what they need comes with them."""
    return st.lists(st.sampled_from(drawn()), min_size=least, max_size=most)


def stiffness(circuit: Circuit, reference: Reference) -> float:
    """Steps that the fastest mode met on the reference's way asks of an explicit method of order 5."""
    system = circuit.system()
    functions = Functions(system, system.values(circuit.design()))
    rows, fastest = reference.tight.steps, 0.0
    pattern = functions.pattern
    for k in np.unique(np.linspace(0, rows.t.size - 1, 40).astype(int)).tolist():
        functions.h, functions.b = rows.h[k], rows.b[k]
        matrix = np.zeros(pattern.shape)
        matrix[pattern.indices, np.repeat(np.arange(functions.n), np.diff(pattern.indptr))] = functions.nonzeros(
            float(rows.t[k]), rows.x[k]
        )
        if functions.n and np.isfinite(matrix).all():
            fastest = max(fastest, float(np.abs(np.linalg.eigvals(matrix)).max()))
    return fastest * float(rows.t[-1] - rows.t[0]) / 2.2


def compared(circuit: Circuit, most: int, counts: Counter[str]) -> list[str]:
    """What each solver does otherwise than the reference, with at most so many steps for its stiffness."""
    reference = Reference(circuit)
    if reference.doubt:
        counts["undetermined"] += 1
        return []
    counts["failed alike"] += reference.tight.status == "failed"
    stiff = stiffness(circuit, reference) if reference.tight.status != "failed" else 0.0
    wrong: list[str] = []
    for solver, multiple in MULTIPLE.items():
        if solver in EXPLICIT and stiff > (most if solver == "dopri" else most / 20 if most > FEW else most):
            counts[f"{solver}: stiff"] += 1
            continue
        trajectory = run(circuit, solver, RTOL).trajectory
        found = reference.compare(trajectory, RTOL)
        if found.multiple > multiple and any(TOLD in warning for warning in trajectory.warnings):
            counts[f"{solver}: told"] += 1
            continue
        counts[solver] += 1
        if found.multiple > multiple or found.events or found.ended:
            wrong.append(f"{solver}: {found}")
    return wrong


def check(kinds: list[str], seed: int, stop: str, most: int, counts: Counter[str]) -> None:
    """One circuit by every solver."""
    data = circuit_data(kinds, seed, stop)
    circuit = Circuit(Netlist.of(data))
    try:
        circuit.system()
    except InputError:
        counts["refused"] += 1
        return
    counts["circuits"] += 1
    counts["parts"] += len(data["components"])
    wrong = compared(circuit, most, counts)
    if wrong:
        note(f"seed {seed}, types {kinds}\n{yaml_text(data)}")
    assert not wrong, f"seed {seed}, types {kinds}: {' | '.join(wrong)}"


CHECKED = settings(
    deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck), phases=(Phase.generate,),
    print_blob=False,
)  # fmt: skip


def test_60_circuits_agree(capsys: pytest.CaptureFixture[str]) -> None:
    """60 are drawn, small ones, 5 ms long; how many of them counted, and for which solver, is printed."""
    counts: Counter[str] = Counter()

    @settings(CHECKED, max_examples=60)
    @given(types(1, 5), st.integers(0, 2**32 - 1))
    def every(kinds: list[str], seed: int) -> None:
        check(kinds, seed, "5 ms", FEW, counts)

    every()
    with capsys.disabled():
        print(f"\nrandom circuits: {dict(counts)}")
    assert counts["rodas"] + counts["refused"] + counts["undetermined"] >= 60
    assert counts["refused"] <= 5


@pytest.mark.campaign
@pytest.mark.parametrize("block", range(BLOCKS))
def test_2000_circuits_agree(block: int, capsys: pytest.CaptureFixture[str]) -> None:
    """Blocks of 50, the later ones of more parts; each has a seed of its own."""
    counts: Counter[str] = Counter()
    least = 1 + block * 12 // BLOCKS

    @seeded(block)
    @settings(CHECKED, max_examples=PER_BLOCK, derandomize=False)
    @given(types(least, least + 12), st.integers(0, 2**32 - 1))
    def every(kinds: list[str], seed: int) -> None:
        check(kinds, seed, "10 ms", MANY, counts)

    every()
    with capsys.disabled():
        print(f"\nrandom circuits, block {block}: {dict(counts)}")


def test_the_whole_library_is_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    """Of 2000 seeds, one type at a time: every type that is not left out, with a reason, stands in a circuit."""
    kinds, found, sizes = drawn(), Counter[str](), []
    for seed in range(2000):
        data = circuit_data([kinds[seed % len(kinds)]], seed)
        sizes.append(len(data["components"]))
        found.update({part["type"] for part in data["components"].values()})
    with capsys.disabled():
        rarest = min(found, key=lambda kind: found[kind])
        print(
            f"\n{len(found)} of {len(kinds)} types in 2000 seeds, the rarest {rarest} in {found[rarest]}; "
            f"left out: {', '.join(LEFT_OUT)}"
        )
    assert set(found) == set(kinds)
    assert set(LEFT_OUT) <= set(library())


TO_INFINITY = """
crescentlab: 1
fluid: {type: water}
components:
  low: {type: capacity, volume: 227.5 cm3, start: {p: 29.02 bar}}
  high: {type: capacity, volume: 101.7 cm3, start: {p: 37.58 bar}}
  gap: {type: annular_gap, diameter: 8.8 mm, clearance: 0.01 mm, length: 5.3 mm}
  steps: {type: quantizer, output_quantity: flow, step: 2.5 L/min}
  relay: {type: relay, output_quantity: flow, input_quantity: power, upper: 300 W, lower: 200 W, on_value: 20 L/min,
          off_value: -5 L/min}
  meter: {type: linear_power_meter}
  mass: {type: mass, mass: 1.223 kg, start: {x: 8.113 mm}}
  spring: {type: spring, stiffness: 14.61 N/mm}
  damper: {type: damper, coefficient: 120.4 N s/m}
  source: {type: signal_flow_source}
  set: {type: step, output_quantity: pressure, before: 33.99 bar, after: 38.78 bar, at: 0.4166 ms}
  valve: {type: proportional_relief_valve, area: 28.83 mm2, lambda_c: 89.13, time_constant: 3.747 ms,
          opening_range: 2.188 bar}
nets:
  p_low: [low.port, gap.b, valve.b]
  p_high: [high.port, gap.a, source.port, valve.a]
  flow: [steps.y, source.flow]
  switched: [relay.y, steps.u]
  rod: [mass.port, spring.rod, damper.rod, meter.a]
  end: [meter.b]
  power: [meter.y, relay.u]
  set_pressure: [set.y, valve.setting]
simulation: {stop: 8 ms}
"""
"""Water drained until its vapour makes it soft: a trial step ended on no number, and was once taken for a good one."""
FIXED = {"a step to infinity": TO_INFINITY}
"""Circuits that once failed."""


@pytest.mark.parametrize("case", FIXED)
def test_a_circuit_that_once_failed(case: str) -> None:
    wrong = compared(Circuit(Netlist.of(yaml.safe_load(FIXED[case]))), FEW, Counter())
    assert not wrong, f"{case}: {' | '.join(wrong)}"
