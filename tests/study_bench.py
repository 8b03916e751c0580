"""A circuit whose end is known in closed form, a study of it, and ways to run it in tests."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator
from math import exp, log
from pathlib import Path
from typing import Any

import pytest

from crescentlab.cli import main
from crescentlab.studies.points import Job, Reply
from crescentlab.studies.worker import Workshop, answer

OIL = "{type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"

FILLING = f"""\
crescentlab: 1
fluid: {OIL}
library: [./fuse.py]
parameters:
  supply: 6 L/min
  volume: 100 cm^3
  burns_at: 0
components:
  pump: {{type: flow_source, flow: = supply}}
  line: {{type: capacity, volume: = volume, start: {{p: 1 bar}}}}
  fuse: {{type: fuse, burns_at: = burns_at}}
nets:
  p_line: [pump.port, line.port]
simulation: {{stop: 10 ms}}
"""
"""A volume without an outlet, whose pressure is known in closed form (:func:`pressure`)."""

FUSE = '''\
import os

from pydantic import Field, field_validator

from crescentlab.component import Component, Equations
from crescentlab.domain import observable
from crescentlab.maths import Expr
from crescentlab.units import Ratio


class Fuse(Component):
    """Ends its process if it is told to."""

    burns_at: Ratio = Field(default=0.0, description="1 burns")
    level = observable(Ratio, "what it was told")

    @field_validator("burns_at")
    @classmethod
    def _burn(cls, value: float) -> float:
        if value == 1.0:
            os._exit(7)
        return value

    def equations(self) -> Equations:
        return {"level": self.burns_at + 0.0}
'''

STUDY = """\
crescentlab_study: 1
title: Filling
circuit: filling.yaml
vary:
  grid: {supply: [3 L/min, 6 L/min, 12 L/min]}
run: {stop: 10 ms, rtol: 1e-8}
measure:
  last: final(line.p)
  swing: peak_to_peak(line.p)
"""


class Here:
    """Runs jobs in this process, one after another: the order is known, and no process has to start."""

    ran: list[str] = []
    stop_after: int | None = None

    def __init__(self, workers: int = 1) -> None:
        self.width = workers

    def run(self, jobs: Iterable[Job]) -> Iterator[Reply]:
        workshop = Workshop()
        for job in jobs:
            if Here.stop_after is not None and len(Here.ran) >= Here.stop_after:
                raise KeyboardInterrupt
            Here.ran.append(job.key)
            yield answer(workshop, job, io.BytesIO())

    def close(self) -> None:
        """Nothing to end."""


def write(folder: Path, study: str = STUDY) -> None:
    """The circuit, its part, and a study."""
    (folder / "filling.yaml").write_text(FILLING, encoding="utf-8")
    (folder / "fuse.py").write_text(FUSE, encoding="utf-8")
    (folder / "s.yaml").write_text(study, encoding="utf-8")


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """The JSON object that a command prints."""
    capsys.readouterr()
    main([*arguments, "--json", "--quiet"])
    found = json.loads(capsys.readouterr().out)
    assert found["status"] not in ("invalid", "bug"), found["error"]
    return found


def pressure(supply: float, volume: float = 1e-4, seconds: float = 0.01) -> float:
    """End pressure [Pa]: rho V grows by rho_0 q, rho = rho_0 exp(p/beta), so exp(p/beta) = exp(p0/beta) + q t / V."""
    beta = 1.4e9
    return beta * log(exp(1e5 / beta) + supply * seconds / volume)
