"""``crescentlab new component``: the file of a component of one's own, and its test, both of which run as they are."""

from __future__ import annotations

import argparse
import importlib.util
import keyword
import re
from pathlib import Path

from crescentlab.cli import DONE
from crescentlab.component import snake_case
from crescentlab.errors import InputError
from crescentlab.library import installed

COMPONENT = '''\
"""{title}."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import dissipates, observable, takes_pressure
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, hypot, sqrt
from crescentlab.units import Area, Flow, Pressure, Ratio


class {name}(Component):
    r"""{title}: as it stands, a sharp-edged orifice between two nets.

    .. math:: \\rho_0 q = C_d A \\sqrt{{2 \\rho |\\Delta p|}} \\, \\mathrm{{sign}} \\, \\Delta p

    \\Delta p = p_a - p_b [Pa]; q [m^3/s] from a to b, mass flow over \\rho_0, the density at 0 bar gauge; C_d = `cd`
    [-]; A = `area` [m^2]; \\rho [kg/m^3] at the mean pressure. The root is rounded within `drop_rounding` [Pa] of zero
    drop, where its slope would be infinite. Not for laminar flow. Source: Bernoulli's law.
    """

    area: Area = Field(gt=0, description="flow area")
    cd: Ratio = Field(default=0.7, gt=0, le=1, description="discharge coefficient")
    drop_rounding: Pressure = Field(default=100.0, gt=0, description="rounding of the velocity at zero drop")

    a = takes_pressure("upstream")
    b = takes_pressure("downstream")
    q = observable(Flow, "flow from a to b")
    loss = dissipates()

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        drop, density = p_a - p_b, fluid.density((p_a + p_b) / 2)
        mass_flow = self.cd * self.area * drop * sqrt(2 * density / hypot(drop, self.drop_rounding))
        q = mass_flow / fluid.rho_0
        return {{"q_a": q, "q_b": -q, "q": q}}
'''

TEST = '''\
"""{title}: the contract of all components, and a number worked out by hand."""

from math import sqrt

import pytest
from {module} import {name}

from crescentlab.components.fluids import SimpleOil
from crescentlab.contract import check_component

OIL = SimpleOil(density=860.0, kinematic_viscosity=35e-6, bulk_modulus=1.4e9)


def test_contract() -> None:
    check_component({name}(area=5e-6), OIL)


def test_flow_at_ten_bar() -> None:
    """Bernoulli's law by hand with rho_0; at the mean pressure, 5 bar, rho is 3.6e-4 larger, its root half of that."""
    flow = {name}(area=5e-6).equations(p_a=10e5, p_b=0.0, fluid=OIL)["q"]
    assert flow == pytest.approx(0.7 * 5e-6 * sqrt(2 * 10e5 / 860.0), rel=2e-4)
'''

SNAKE, CAMEL = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*"), re.compile(r"[A-Z][A-Za-z0-9]*")
"""Names as circuits write types, and as Python writes classes."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("kind", choices=["component"], help="what to write")
    parser.add_argument("name", metavar="NAME", help="the type, as my_valve or MyValve")
    parser.add_argument("--folder", metavar="DIR", default=".", help="where to write it (here)")


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    name = class_name(options.name)
    paths = written(name, Path(options.folder))
    print("\n".join(str(path) for path in paths))
    module = snake_case(name)
    print(f"test it:            pytest {paths[1]}")
    print(f"use it in a circuit beside it:  library: [./{module}.py]  and  {{type: {module}, area: 5 mm^2}}")
    return DONE


def class_name(text: str) -> str:
    """The class's name in CamelCase; raises :class:`InputError` for what cannot be a type of one's own."""
    if not (SNAKE.fullmatch(text) or CAMEL.fullmatch(text)):
        raise InputError(f"{text!r} cannot be a component's name; write it as my_valve or MyValve")
    name = text if CAMEL.fullmatch(text) else "".join(word.capitalize() for word in text.split("_"))
    kind = snake_case(name)
    if SNAKE.fullmatch(text) and kind != text:
        raise InputError(f"{text!r}: its class, {name}, would be the type {kind!r}; write {kind}")
    if keyword.iskeyword(kind) or keyword.iskeyword(name):
        raise InputError(f"{text!r} is a keyword of Python; write for example {kind}_valve")
    library = installed()
    if kind in library.components or kind in library.fluids:
        raise InputError(f"the type {kind!r} already exists (crescentlab components {kind}); choose another name")
    if name in re.findall(r"\w+", " ".join(re.findall(r"import (.*)", COMPONENT + TEST))) or kind.startswith("test"):
        raise InputError(f"{text!r} has a meaning of its own in a component's file; write for example my_{kind}")
    if importlib.util.find_spec(kind) is not None:
        raise InputError(f"{text!r}: Python already has a module {kind!r}; write for example my_{kind}")
    return name


def written(name: str, folder: Path) -> tuple[Path, Path]:
    """Write the component and its test; raises :class:`InputError` rather than replace a file."""
    module = snake_case(name)
    paths = folder / f"{module}.py", folder / f"test_{module}.py"
    for path in paths:
        if path.exists():
            raise InputError(f"{path} exists; remove it, or choose another name or --folder")
    title = module.replace("_", " ").capitalize()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in zip(paths, (COMPONENT, TEST), strict=True):
            path.write_text(text.format(title=title, name=name, module=module), encoding="utf-8")
    except OSError as error:
        raise InputError(f"--folder {folder}: cannot be written ({error.strerror})") from None
    return paths
