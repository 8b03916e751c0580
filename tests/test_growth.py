"""Costs grow as the circuit does: counts of what is made for chains of orifices and volumes, no seconds."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import yaml

from crescentlab import causality
from crescentlab.assembly import _Assembly, assemble
from crescentlab.causality import plan
from crescentlab.elaborate import elaborate
from crescentlab.graph import build
from crescentlab.library import installed
from crescentlab.netlist import Netlist
from crescentlab.solvers.loop import Options, integrate
from crescentlab.system import System

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
SIZES = (400, 800, 1600)
"""Above the size to which common parts are searched for, so that one rule holds for all."""


@pytest.fixture
def netlist(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, int], Netlist]:
    """Builder of chains, grids and stars, as the benchmarks use it."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import chains

    return chains.netlist


def assembled(netlist: Netlist) -> System:
    """The system, ready to be integrated."""
    system = assemble(plan(build(elaborate(netlist, installed())), installed()))
    for name in ("rhs", "jacobian", "relation", "relation_on_state", "condition"):
        getattr(system, name)
    return system


def test_instructions_and_nonzeros_are_those_of_so_many_parts(netlist: Callable[[str, int], Netlist]) -> None:
    systems = [assembled(netlist("chain", n)) for n in SIZES]
    for n, system in zip(SIZES, systems, strict=True):
        assert system.jacobian_expression.nnz() == 3 * n - 2
        assert system.jacobian.function.nnz_out(0) == 3 * n - 2
    for name in ("rhs", "jacobian"):
        functions = [getattr(system, name).function for system in systems]
        small, middle, large = [f.n_instructions() for f in functions]
        assert large - middle == 2 * (middle - small), name
        small, middle, large = [sum(f.nnz_in(k) for k in range(f.n_in())) for f in functions]
        assert large - middle == 2 * (middle - small), name
        assert functions[0].sz_w() == functions[2].sz_w(), f"the work space of {name} grows"


def test_many_volumes_around_one_cost_no_more_than_in_a_row(netlist: Callable[[str, int], Netlist]) -> None:
    """The wide row of the one is differentiated by itself, and gives what CasADi gives for the whole."""
    small, middle, large = [assembled(netlist("star", n)).jacobian.function.n_instructions() for n in SIZES]
    assert large - middle == 2 * (middle - small)
    system = assembled(netlist("star", 120))
    whole = ca.jacobian(system.f, system.x)
    assert whole.sparsity() == system.jacobian_expression.sparsity()
    both = ca.Function("both", system.arguments, [whole, system.jacobian_expression])
    values = system.values(system.plan.design)
    x = values.x0 * np.linspace(0.5, 1.5, values.x0.size)
    first, second = [np.array(m.nonzeros()) for m in both(0.1, x, values.h0, [], values.p)]
    np.testing.assert_allclose(second, first, rtol=1e-12)


def test_traces_and_their_calls_are_as_many_for_a_long_chain(
    netlist: Callable[[str, int], Netlist], monkeypatch: pytest.MonkeyPatch
) -> None:
    counts: dict[str, int] = {}

    def counted(name: str, function: Callable[..., object]) -> Callable[..., object]:
        def count(*args: object, **kwargs: object) -> object:
            counts[name] = counts.get(name, 0) + 1
            return function(*args, **kwargs)

        return count

    monkeypatch.setattr(causality, "trace", counted("trace", causality.trace))
    monkeypatch.setattr(_Assembly, "call", counted("call", _Assembly.call))
    found = []
    for n in (10, 100):
        counts.clear()
        assemble(plan(build(elaborate(netlist("chain", n), installed())), installed()))
        found.append(dict(counts))
    assert found[0] == found[1]
    assert found[0]["trace"] == 5, "one for each kind of part"


@pytest.mark.parametrize("kind", ["chain", "star"])
def test_memory_grows_with_the_parts(kind: str, netlist: Callable[[str, int], Netlist]) -> None:
    """numpy and Python report what they take; a dense n x n matrix or n vectors of n would make it 16 times."""

    def most(n: int) -> int:
        made = netlist(kind, n)
        tracemalloc.start()
        try:
            system = assembled(made)
            assert integrate(system, system.values(system.plan.design), Options(stop=1e-5)).complete
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    most(10)  # what is imported and cached once
    assert most(1200) < 4.6 * most(300)  # 4**1.1


def test_a_large_file_reads_like_the_data_it_was_written_from(
    netlist: Callable[[str, int], Netlist], tmp_path: Path
) -> None:
    made = netlist("chain", 50)
    path = tmp_path / "chain.yaml"
    path.write_text(yaml.safe_dump(made.node.plain(), sort_keys=False, default_flow_style=None), encoding="utf-8")
    read = Netlist.read(path)
    assert read.sections == made.sections
    lines = path.read_text(encoding="utf-8").splitlines()
    for name in made.sections.components:
        place = read.place("components", name)
        assert place is not None
        assert lines[place.line - 1].strip().startswith(f"{name}:")
