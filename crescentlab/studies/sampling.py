"""What varies -> points: grids, lists, random and low-discrepancy samples, corners of tolerances.

Each point of a sample is a function of the seed and its index alone, so that a larger count keeps the points there
were (a Latin hypercube cannot: one of another count is another hypercube).

Sources: Sobol sequence with Owen's scrambling and Latin hypercube as of :mod:`scipy.stats.qmc`; random numbers PCG64,
seeded by NumPy's SeedSequence (seed, index).
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import qmc

from crescentlab.errors import InputError, nearest
from crescentlab.studies.distributions import Distribution, distribution, number, spread, tolerance, value
from crescentlab.studies.study_file import SAMPLES, Study
from crescentlab.units import Quantity
from crescentlab.yaml_text import Node

MAX_POINTS = 1_000_000
"""Most points of a study."""
MAX_CORNERS = 20
"""Most settings whose corners are all taken: their number doubles with each."""
EDGE = 2.0**-40
"""A sample keeps this distance from the cube's faces, where a normal distribution is infinite."""
RANGE = ("from", "to", "count", "step", "spacing")

Quantities = Callable[[str], Quantity | None]
"""Quantity of a setting by its name; None for words."""


@dataclass(frozen=True)
class Point:
    """Texts of the varied settings, and what the point is among its kind (``nominal``, ``gap low``)."""

    settings: Mapping[str, str] = field(default_factory=dict)
    role: str = ""


def points(study: Study, quantities: Quantities) -> list[Point]:
    """All points in their order: the first section written varies slowest."""
    vary = study.node.find(("vary",))
    assert isinstance(vary.value, dict)
    varied(study)
    axes: list[list[Point]] = []
    for kind in vary.value:
        made = _MADE[kind](study, vary.value[kind], quantities)
        axes += made
    count = math.prod(len(axis) for axis in axes)
    if not axes or count == 0:
        raise InputError("nothing varies; write for example grid: {speed: [1000 rpm, 2000 rpm]}", study.place("vary"))
    if count > MAX_POINTS:
        raise InputError(f"{count} points; a study has at most {MAX_POINTS}", study.place("vary"))
    return [_joined(parts) for parts in itertools.product(*axes)]


def _joined(parts: tuple[Point, ...]) -> Point:
    settings = {name: text for part in parts for name, text in part.settings.items()}
    return Point(settings, ", ".join(part.role for part in parts if part.role))


def varied(study: Study) -> dict[str, tuple[str, ...]]:
    """Names of what varies, with the path of each in the file; raises :class:`InputError` for a name given twice."""
    found: dict[str, tuple[str, ...]] = {name: ("set", name) for name in study.sections.settings}
    vary = study.node.find(("vary",)).value
    assert isinstance(vary, dict)
    for kind in vary:
        path = ("vary", kind, "parameters") if kind in SAMPLES else ("vary", kind)
        section = study.node.find(path).value
        assert isinstance(section, dict)
        for name in section:
            if name in found:
                other = found[name][1] if found[name][0] == "vary" else "set"
                raise InputError(f"{name} stands in {other} too; keep one of them", study.place(*path, name))
            found[name] = (*path, name)
    return {name: path for name, path in found.items() if path[0] == "vary"}


# -- listed values -------------------------------------------------------------------------------


def _grid(study: Study, node: Node, quantities: Quantities) -> list[list[Point]]:
    """One axis for each name."""
    assert isinstance(node.value, dict)
    return [
        [Point({name: text}) for text in _different(child, _values(child, quantities(name), name), name)]
        for name, child in node.value.items()
    ]


def _rows(study: Study, node: Node, quantities: Quantities) -> list[list[Point]]:
    """One axis of rows."""
    assert isinstance(node.value, dict)
    columns = {name: _values(child, quantities(name), name) for name, child in node.value.items()}
    lengths = {name: len(texts) for name, texts in columns.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise InputError(f"the lists must be equally long: {said}", study.place("vary", "list"))
    return [[Point(dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]]


def _values(node: Node, quantity: Quantity | None, name: str) -> list[str]:
    """Texts of a list, of a range, or of one value."""
    if isinstance(node.value, dict):
        return _range(node, quantity, name)
    items = node.value if isinstance(node.value, list) else [node]
    texts = [value(item, quantity, name) for item in items]
    if not texts:
        raise InputError(f"{name}: the list is empty; write at least one value", node.place)
    return texts


def _different(node: Node, texts: list[str], name: str) -> list[str]:
    """The texts of an axis, none of which may stand twice; in rows they may."""
    if len(set(texts)) < len(texts):
        twice = next(text for text in texts if texts.count(text) > 1)
        raise InputError(f"{name}: {twice!r} stands twice; remove one", node.place)
    return texts


def _range(node: Node, quantity: Quantity | None, name: str) -> list[str]:
    """``{from, to, count, spacing}`` or ``{from, to, step}``, in the unit of ``from``."""
    assert isinstance(node.value, dict)
    for key in node.value:
        if key not in RANGE:
            raise InputError(f"{name}: unknown key {key!r}: {nearest(key, RANGE)}", node.keys[key])
    for key in ("from", "to"):
        if key not in node.value:
            raise InputError(
                f"{name}.{key} is missing; write for example {{from: 0 mm, to: 6 mm, count: 7}}", node.place
            )
    if ("count" in node.value) == ("step" in node.value):
        raise InputError(f"{name}: write either count or step", node.place)
    low, high = (number(node.value[key], quantity, f"{name}.{key}") for key in ("from", "to"))
    if low == high:
        raise InputError(f"{name}: from and to are equal; write one value", node.place)
    assert quantity is not None
    spacing = node.value["spacing"].value if "spacing" in node.value else "linear"
    if spacing not in ("linear", "log"):
        raise InputError(f"{name}.spacing must be 'linear' or 'log', not {spacing!r}", node.keys["spacing"])
    if spacing == "log" and (min(low, high) <= 0 or "step" in node.value):
        raise InputError(f"{name}: spacing: log needs a count, and from and to above 0", node.place)
    count = _count(node, quantity, low, high, name)
    made = np.geomspace(low, high, count) if spacing == "log" else np.linspace(low, high, count)
    unit = _UNIT.sub("", str(node.value["from"].value))
    return [quantity.show(each, unit, DIGITS) for each in made.tolist()]


_UNIT = re.compile(r"^\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")
DIGITS = 12
"""Digits of the values between the ends of a range: fewer than a number has, so that they are the same in any order of
reckoning, and a finer range keeps the points of a coarser one."""


def _count(node: Node, quantity: Quantity, low: float, high: float, name: str) -> int:
    """How many values a range has."""
    assert isinstance(node.value, dict)
    if "count" in node.value:
        text = str(node.value["count"].value)
        if not text.isdecimal() or int(text) < 2:
            raise InputError(f"{name}.count must be a whole number from 2 on, not {text!r}", node.keys["count"])
        return int(text)
    step = spread(node.value["step"], quantity, 0.0, f"{name}.step")
    steps = abs(high - low) / step if step else 0.0
    if not steps or abs(steps - round(steps)) > 1e-6 * steps:
        raise InputError(f"{name}.step does not lead from {name}.from to {name}.to; write count", node.keys["step"])
    return round(steps) + 1


# -- samples -------------------------------------------------------------------------------------


def unit_sample(kind: str, count: int, dimensions: int, seed: int) -> np.ndarray:
    """Points of the open unit cube, shape (count, dimensions)."""
    if kind == "monte_carlo":
        cube = np.array([_random(seed, index, dimensions) for index in range(count)])
    elif kind == "sobol":
        whole = 1 << (count - 1).bit_length()  # the first points of a power of two, for which the sequence is balanced
        cube = qmc.Sobol(dimensions, scramble=True, seed=np.random.default_rng(seed)).random(whole)[:count]
    else:
        cube = qmc.LatinHypercube(dimensions, seed=np.random.default_rng(seed)).random(count)
    return np.asarray(np.clip(cube, EDGE, 1 - EDGE))


def _random(seed: int, index: int, dimensions: int) -> np.ndarray:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(index,)))).random(dimensions)


def _sample(kind: str) -> Callable[[Study, Node, Quantities], list[list[Point]]]:
    """One axis of points drawn from distributions."""

    def made(study: Study, node: Node, quantities: Quantities) -> list[list[Point]]:
        section = getattr(study.sections.vary, kind)
        listed = node.find(("parameters",)).value
        assert isinstance(listed, dict)
        drawn: dict[str, Distribution] = {n: distribution(child, quantities(n), n) for n, child in listed.items()}
        if section.count > MAX_POINTS:
            raise InputError(f"{kind}: a study has at most {MAX_POINTS} points", node.place_of("count"))
        cube = unit_sample(kind, section.count, len(drawn), section.seed)
        columns = [d.texts(u) for d, u in zip(drawn.values(), cube.T, strict=True)]
        return [[Point(dict(zip(drawn, row, strict=True))) for row in zip(*columns, strict=True)]]

    return made


# -- tolerances ----------------------------------------------------------------------------------


def _corners(study: Study, node: Node, quantities: Quantities) -> list[list[Point]]:
    """The nominal point and every combination of the tolerances' ends."""
    assert isinstance(node.value, dict)
    ends = {name: tolerance(child, quantities(name), name) for name, child in node.value.items()}
    if len(ends) > MAX_CORNERS:
        raise InputError(
            f"{len(ends)} settings have 2^{len(ends)} corners; use one_at_a_time or monte_carlo",
            study.place("vary", "corners"),
        )
    made = [Point({name: each.nominal for name, each in ends.items()}, "nominal")] if ends else []
    for signs in itertools.product(("low", "high"), repeat=len(ends)):
        settings = {name: getattr(ends[name], sign) for name, sign in zip(ends, signs, strict=True)}
        made.append(Point(settings, ", ".join(f"{n} {s}" for n, s in zip(ends, signs, strict=True))))
    return [made] if ends else []


def _one_at_a_time(study: Study, node: Node, quantities: Quantities) -> list[list[Point]]:
    """The nominal point, and each tolerance's two ends with all others at their nominal value."""
    assert isinstance(node.value, dict)
    ends = {name: tolerance(child, quantities(name), name) for name, child in node.value.items()}
    nominal = {name: each.nominal for name, each in ends.items()}
    made = [Point(nominal, "nominal")] if ends else []
    for name, each in ends.items():
        made += [Point({**nominal, name: getattr(each, sign)}, f"{name} {sign}") for sign in ("low", "high")]
    return [made] if ends else []


_MADE: dict[str, Callable[[Study, Node, Quantities], list[list[Point]]]] = {
    "grid": _grid, "list": _rows, "corners": _corners, "one_at_a_time": _one_at_a_time,
    **{kind: _sample(kind) for kind in SAMPLES},
}  # fmt: skip
