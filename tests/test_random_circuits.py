"""Random circuits of the whole library: every solver gives what the reference gives, and the same events.

``make test`` runs 60 small ones, ``make campaign`` 2000 of 3 to 60 parts. A failure prints the seed, the types and the
circuit; it becomes a fixed case below.
"""

from __future__ import annotations

import os
from collections import Counter
from typing import Any

import numpy as np
import pytest
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
    "rodas": 100, "radau": 100, "lsoda": 200, "auto": 200, "dopri": 100, "rk45": 100, "dop853": 100, "bdf": 100,
    "cvode": 200,
}  # fmt: skip
"""How far a solver's run may be from the reference, in tolerances; stated in docs/solvers.md."""
EXPLICIT = ("dopri", "rk45", "dop853")
FEW = 1_000
"""Steps that stiffness may ask of an explicit method in the suite; a stiffer circuit is left to the others."""
MANY = 100_000
"""The same of dopri in the campaign; SciPy's take a twentieth."""
BLOCKS, PER_BLOCK = 40, 50
STARTS = 400
"""Steps of the reference, in the suite, beyond which a circuit is left to the campaign."""


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


def check(kinds: list[str], seed: int, stop: str, most: int, counts: Counter[str], steps: float = np.inf) -> None:
    """One circuit by every solver."""
    data = circuit_data(kinds, seed, stop)
    circuit = Circuit(Netlist.of(data))
    try:
        circuit.system()
    except InputError:
        counts["refused"] += 1
        return
    reference = Reference(circuit)
    counts["circuits"] += 1
    counts["parts"] += len(data["components"])
    if reference.doubt:
        counts["undetermined"] += 1
        return
    if reference.tight.statistics.steps > steps:
        counts["long"] += 1
        return
    counts["failed alike"] += reference.tight.status == "failed"
    stiff = stiffness(circuit, reference) if reference.tight.status != "failed" else 0.0
    wrong: list[str] = []
    for solver, multiple in MULTIPLE.items():
        if solver in EXPLICIT and stiff > (most if solver == "dopri" else most / 20 if most > FEW else most):
            counts[f"{solver}: stiff"] += 1
            continue
        found = reference.compare(run(circuit, solver, RTOL).trajectory, RTOL)
        counts[solver] += 1
        if found.multiple > multiple or found.events or found.ended:
            wrong.append(f"{solver}: {found}")
    if wrong and "COLLECT" in os.environ:
        with open(os.environ["COLLECT"], "a") as file:
            file.write(f"{kinds!r}\t{seed}\t{wrong}\n")
        return
    if wrong:
        note(f"seed {seed}, types {kinds}\n{yaml_text(data)}")
    assert not wrong, f"seed {seed}, types {kinds}: {' | '.join(wrong)}"


CHECKED = settings(
    deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck), phases=(Phase.generate,),
    print_blob=False,
)  # fmt: skip


def test_60_circuits_agree(capsys: pytest.CaptureFixture[str]) -> None:
    """Small ones, 5 ms long: 60 that count."""
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


FIXED: dict[str, Any] = {}
"""Circuits that once failed, each with what it failed on."""


@pytest.mark.parametrize("case", FIXED)
def test_a_circuit_that_once_failed(case: str) -> None:
    kinds, seed = FIXED[case]
    check(kinds, seed, os.environ.get("STOP", "5 ms"), FEW, Counter())
