"""The ledger of stored fluid where next to nothing flows."""

from __future__ import annotations

from pathlib import Path

import pytest

import crescentlab as cl
from crescentlab.circuit import Circuit

TWO_VOLUMES = """
crescentlab: 1
fluid: {type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}
components:
  one: {type: capacity, volume: 70 cm^3, start: {p: 3.3 bar}}
  hole: {type: orifice, area: 5 mm^2}
  other: {type: capacity, volume: 70 cm^3, start: {p: 3.3 bar}}
nets:
  p: [one.port, hole.a]
  t: [hole.b, other.port]
simulation: {stop: 10 ms}
"""


@pytest.fixture
def two_volumes(tmp_path: Path) -> Circuit:
    (tmp_path / "two.yaml").write_text(TWO_VOLUMES, encoding="utf-8")
    return cl.load(tmp_path / "two.yaml")


@pytest.mark.parametrize("solver", ["auto", "rodas"])
@pytest.mark.parametrize("pascal", [1e-3, 1e-9])
def test_what_the_tolerance_leaves_at_rest_is_no_error(two_volumes: Circuit, solver: str, pascal: float) -> None:
    """Pressures err by some rtol p, contents by V rtol p/beta: over a millionth of V that is p/beta = 2.4e-4."""
    result = two_volumes.simulate(None, {"one.start.p": f"{3.3e5 + pascal!r} Pa"}, solver=solver)
    assert result.balance is not None
    assert max(result.balance.components.values()) < 4 * 3.3e5 / 1.4e9


def test_errors_are_shares_of_the_flow_where_fluid_flows(two_volumes: Circuit) -> None:
    """Equalising 3.3 and 1 bar moves V dp/(2 beta) = 5.75e-8 m^3, more than a millionth of V."""
    result = two_volumes.simulate(None, {"other.start.p": "1 bar"})
    assert result.balance is not None
    assert 0 < max(result.balance.components.values()) < 1e-2
