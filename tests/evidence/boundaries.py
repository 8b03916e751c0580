"""Ends of a circuit."""

from __future__ import annotations

import math

from building import OIL, circuit
from crescentlab.components.boundaries import Plug

from crescentlab.result import Result
from evidence import Number, evidence

BAR, LPM = 1e5, 1e-3 / 60


def through_an_orifice(source: dict[str, str], **more: dict[str, str]) -> Result:
    """A source of pressure, a turbulent orifice of 5 mm^2 and Cd 0.7, and a tank at 2 bar."""
    parts = {
        "source": source, "hole": {"type": "orifice", "area": "5 mm^2", "lambda_c": "1"},
        "tank": {"type": "tank", "pressure": "2 bar"}, **more,
    }  # fmt: skip
    nets = {"high": ["source.port", "hole.a"], "low": ["hole.b", "tank.port"]}
    nets |= {"signal": ["law.y", "source.pressure"]} if more else {}
    return circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "1 s"}).simulate()


@evidence(
    "pressure_source",
    "signal_pressure_source",
    "tank",
    source="Torricelli's law with Cd 0.7 between the two pressures held",
    tolerance=1e-12,
    because="rounding alone: the density is taken at the mean pressure by hand as well",
)
def pressures_held() -> list[Number]:
    """Flow from 100 bar through 5 mm^2 into a tank at 2 bar: the mass flow Cd A sqrt(2 rho dp), over rho_0."""
    expected = 0.7 * 5e-6 * math.sqrt(2 * 98 * BAR * 860 * math.exp(51 / 14000)) / 860
    constant = through_an_orifice({"type": "pressure_source", "pressure": "100 bar"})
    law = {"type": "constant", "value": "100 bar"}
    signal = through_an_orifice({"type": "signal_pressure_source"}, law=law)
    return [
        Number("pressure_source", expected, float(constant["hole.q"][-1]), "L/min"),
        Number("signal_pressure_source", expected, float(signal["hole.q"][-1]), "L/min"),
        Number("into the tank", expected, float(constant["tank.port.q"][-1]), "L/min"),
    ]


@evidence(
    "flow_source",
    "signal_flow_source",
    "atmospheric_vent",
    source="volume = flow times time; ramp: half of its end value times time",
    tolerance=1e-9,
    because="constant and linear flows are integrated exactly by the solver, to rounding",
)
def flows_given() -> list[Number]:
    """What 6 L/min, and a ramp from 0 to 6 L/min, bring to the atmosphere in 2 s: 0.2 and 0.1 L."""
    parts = {
        "steady": {"type": "flow_source", "flow": "6 L/min"}, "first": {"type": "atmospheric_vent"},
        "rising": {"type": "ramp", "after": "6 L/min", "duration": "2 s"}, "driven": {"type": "signal_flow_source"},
        "second": {"type": "atmospheric_vent"},
    }  # fmt: skip
    nets = {"a": ["steady.port", "first.port"], "b": ["driven.port", "second.port"], "s": ["rising.y", "driven.flow"]}
    result = circuit(components=parts, nets=nets, fluid=OIL, simulation={"stop": "2 s"}).simulate()
    return [
        Number("flow_source", 0.2e-3, float(result["first.lost"][-1]), "L"),
        Number("signal_flow_source", 0.1e-3, float(result["second.lost"][-1]), "L"),
        Number("pressure at the vent", 0.0, float(result["first.port.p"][-1]), "bar"),
    ]


@evidence(
    "plug",
    source="a closed end passes nothing, so a closed volume keeps its pressure",
    tolerance=0.0,
    because="nothing is computed",
)
def closed_end() -> list[Number]:
    """Flow into a plug, and the pressure of a volume closed by it after 1 s at 50 bar."""
    parts = {"line": {"type": "capacity", "volume": "1 L", "start": {"p": "50 bar"}}, "end": {"type": "plug"}}
    run = circuit(
        components=parts, nets={"n": ["line.port", "end.port"]}, fluid=OIL, simulation={"stop": "1 s"}
    ).simulate()
    return [
        Number("flow", 0.0, Plug().equations()["q_port"], "L/min"),
        Number("pressure", 50 * BAR, float(run["line.p"][-1]), "bar"),
    ]
