"""One meaning of events, whatever integrates: each sentence of docs/hybrid.md, run by every solver, event by event."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from building import alone
from scenarios import SCENARIOS, Chattering, Instant, Once, Scenario

from crescentlab.result import Result
from crescentlab.solvers.compiled import possible

METHODS = {
    **{name: (name, False) for name in ("auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri")},
    "rodas compiled": ("rodas", True),
    "dopri compiled": ("dopri", True),
}
MANUAL = Path(__file__).parents[2] / "docs" / "hybrid.md"
RTOL = 1e-8


def run(scenario: Scenario, method: str) -> Result:
    """The scenario's run by one method."""
    solver, compiled = METHODS[method]
    if solver in ("rodas", "dopri") and not possible():
        pytest.skip("this machine has no C compiler")
    return scenario.circuit().simulate(scenario.stop, solver=solver, rtol=RTOL, compile=compiled, check=False)


def values_at(result: Result, name: str, time: float, tolerance: float) -> tuple[float, float]:
    """A variable before and after all that happens at an instant."""
    rows = np.flatnonzero(np.abs(result.time - time) <= tolerance)
    series = result[name]
    return float(series[rows[0]] if time else np.nan), float(series[rows[-1]])


def check_instants(result: Result, expected: tuple[Instant, ...], scenario: Scenario) -> None:
    """Names in the order in which they fired, times to 1e-9 of the span, values before and after."""
    happened = [(h.time, h.names) for h in result.trajectory.happenings]
    named = [instant for instant in expected if instant.names]
    assert [names for _, names in happened] == [instant.names for instant in named]
    np.testing.assert_allclose(
        [time for time, _ in happened],
        [instant.time for instant in named],
        rtol=0,
        atol=scenario.time_tolerance * scenario.stop,
    )
    for instant in expected:
        where = np.abs(result.time - instant.time) <= scenario.time_tolerance * scenario.stop
        assert where.sum() >= (2 if instant.time else 1), f"no stop at {instant.time} s"
        for name, (before, after) in instant.values.items():
            seen = values_at(result, name, instant.time, scenario.time_tolerance * scenario.stop)
            np.testing.assert_allclose(seen, (before, after), rtol=0, atol=max(scenario.tolerance, 1e-9))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scenario", SCENARIOS.values(), ids=list(SCENARIOS))
def test_a_rule_holds_in_every_solver(scenario: Scenario, method: str) -> None:
    result = run(scenario, method)
    trajectory = result.trajectory
    if scenario.error:
        assert trajectory.status == "failed"
        assert re.search(scenario.error, trajectory.error)
    else:
        assert trajectory.status == "done", trajectory.error
        assert result.time[-1] == scenario.stop
    if scenario.instants:
        check_instants(result, scenario.instants, scenario)
    for name, value in scenario.end.items():
        assert result[name][-1] == pytest.approx(value, rel=0, abs=scenario.tolerance)
    if scenario.restarts is not None:
        assert trajectory.statistics.restarts == scenario.restarts


@pytest.mark.parametrize("method", METHODS)
def test_a_run_that_goes_on_from_another_fires_nothing_anew(method: str) -> None:
    """ "A run that goes on from another fires nothing anew": the condition has held since 0.25 s."""
    solver, compiled = METHODS[method]
    circuit = alone(Once)
    first = circuit.simulate(0.5, solver=solver, compile=compiled)
    second = circuit.simulate(1.0, solver=solver, compile=compiled, start=first)
    assert [h.names for h in first.trajectory.happenings] == [("part.passes",)]
    assert second.trajectory.happenings == []
    assert second["part.n"][-1] == 1.0


@pytest.mark.parametrize("method", ["rk45", "dop853", "rodas", "dopri", "rodas compiled", "dopri compiled"])
def test_a_storm_of_events_is_told_while_the_run_goes_on(method: str, caplog: pytest.LogCaptureFixture) -> None:
    """1999 resets with one or two steps between: methods that begin with short steps take more, and see no storm."""
    solver, compiled = METHODS[method]
    result = alone(Chattering).simulate(2.0, solver=solver, compile=compiled, rtol=1e-3)
    warning = r"part\.resets has turned 1000 times with fewer than 3 steps between"
    assert [bool(re.search(warning, text)) for text in result.trajectory.warnings] == [True]
    assert re.search(warning, caplog.text)


def manual() -> str:
    """The manual's text on one line."""
    return " ".join(MANUAL.read_text(encoding="utf-8").split())


@pytest.mark.parametrize("scenario", SCENARIOS.values(), ids=list(SCENARIOS))
def test_a_scenario_quotes_the_manual(scenario: Scenario) -> None:
    assert scenario.sentence in manual()
