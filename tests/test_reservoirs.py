"""Reservoirs in circuits: levels, returns above the surface, and the ends of a run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from building import OIL, circuit
from crescentlab.components.fluids import AeratedOil
from crescentlab.components.reservoirs import Reservoir

from crescentlab.contract import Case, check_energy
from crescentlab.errors import SimulationError
from crescentlab.result import Result

BAR, LPM, G = 1e5, 1e-3 / 60, 9.80665
TANK = {"type": "reservoir", "area": "100 cm^2", "height": "0.5 m", "start_level": "0.4 m"}


def drawn(flow: str, returned: str, stop: str = "60 s", **changes: str) -> Result:
    """A pump draws from the outlet; another flow returns above the surface."""
    parts = {
        "tank": {**TANK, "inlets": "1", **changes}, "suction": {"type": "flow_source", "flow": f"-{flow}"},
        "back": {"type": "flow_source", "flow": returned},
    }  # fmt: skip
    nets = {"low": ["tank.outlet", "suction.port"], "high": ["tank.inlet[1]", "back.port"]}
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": stop}).simulate()


def test_level_follows_the_flows() -> None:
    """6 L/min out and 4 in for 60 s: 2 L, 0.2 m of 100 cm^2."""
    result = drawn("6 L/min", "4 L/min")
    assert result["tank.h"][-1] == pytest.approx(0.2, rel=1e-9)
    assert result["tank.level"][-1] == result["tank.h"][-1]
    assert result.balance is not None
    assert result.balance.circuit < 1e-9


def test_pressures_at_its_ports() -> None:
    """Head rho g h at the outlet and none above the surface, both over the pressure on the surface."""
    result = drawn("1 L/min", "1 L/min", stop="1 s", surface_pressure="0.2 bar", outlet_height="0.1 m")
    assert result["tank.outlet.p"][-1] == pytest.approx(0.2 * BAR + 860 * G * 0.3, rel=1e-9)
    assert result["high.p"][-1] == pytest.approx(0.2 * BAR, rel=1e-12)


@pytest.mark.parametrize("surface", [-0.3 * BAR, 0.0, 2 * BAR])
def test_what_enters_is_stored(surface: float) -> None:
    """Above and below 0 bar on the surface, with two inlets and oil that holds air: the head compresses it."""
    part = Reservoir(area=0.01, height=2.0, start_level=1.0, outlet_height=0.1, surface_pressure=surface, inlets=2)
    oil = AeratedOil(
        density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9, air_fraction=0.01, saturation_pressure=1e8
    )
    check_energy(Case(part, oil, {"h": (0.1, 2.0)}))


def test_returned_oil_brings_its_height() -> None:
    """4 L/min come back above the level, which falls from 0.4 m by 33.3 mm/min less q t/A: rho g times integral of h q.

    Oil under 0.4 m is compressed by 1e-6. The pump at the outlet takes out rho g h times its 6 L/min.
    """
    result = drawn("6 L/min", "4 L/min")
    assert result.balance is not None
    energy = result.balance.energy
    assert energy is not None
    mean = 0.3  # of a level that falls evenly from 0.4 to 0.2 m
    assert energy.stored == pytest.approx(860 * G * 0.01 / 2 * (0.2**2 - 0.4**2), rel=1e-5)
    brought = (
        sum(energy.supplied.values()) + 860 * G * mean * 6e-3
    )  # the flow sources supply too: -p q at the outlet, 0 above
    assert brought == pytest.approx(860 * G * mean * 4e-3, rel=1e-5)
    assert max(energy.components.values()) < 1e-9


def test_inlets_are_optional() -> None:
    """None by default; several are one vector port."""
    assert Reservoir(area=1.0, height=1.0, start_level=0.5).size_of("inlets") == 0
    parts = {
        "tank": {**TANK, "inlets": "2"}, "one": {"type": "flow_source", "flow": "1 L/min"},
        "two": {"type": "flow_source", "flow": "2 L/min"}, "end": {"type": "plug"},
    }  # fmt: skip
    nets = {"a": ["tank.inlet[1]", "one.port"], "b": ["tank.inlet[2]", "two.port"], "c": ["tank.outlet", "end.port"]}
    result = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "10 s"}).simulate()
    assert result["tank.h"][-1] == pytest.approx(0.45, rel=1e-9)


def test_a_vent_counts_both_ways() -> None:
    """A sine of 6 L/min, 1 Hz: q/(pi f) = 31.83 cm^3 lost in the first half period, back in the second."""
    parts = {
        "law": {"type": "sine", "amplitude": "6 L/min", "frequency": "1 Hz"}, "pump": {"type": "signal_flow_source"},
        "out": {"type": "atmospheric_vent"},
    }  # fmt: skip
    nets = {"s": ["law.y", "pump.flow"], "n": ["pump.port", "out.port"]}
    result = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "1 s"}).simulate(output_step="0.5 s")
    assert result["out.lost"] == pytest.approx([0.0, 1e-4 / math.pi, 0.0], abs=1e-9)
    assert np.all(result["n.p"] == 0)


def test_it_runs_dry() -> None:
    """0.3 m above the outlet of 100 cm^2 last 30 s at 6 L/min; the run says so instead of pumping air."""
    with pytest.raises(SimulationError, match=r"ended at 30(\.0\d*)? s.*the outlet draws air; raise start_level"):
        drawn("6 L/min", "0 L/min", outlet_height="0.1 m")


def test_it_overflows() -> None:
    """0.1 m of 100 cm^2 take 6 L/min for 10 s."""
    with pytest.raises(SimulationError, match=r"ended at 10(\.0\d*)? s.*the reservoir overflows; raise height"):
        drawn("0 L/min", "6 L/min")
