"""Text -> numbers, tolerances and distributions of a varied setting.

A distribution is known by its quantile function (percent point function), so that any sequence on the unit cube
(random, Sobol, Latin hypercube) becomes a sample of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from crescentlab.errors import InputError, UnitError, nearest
from crescentlab.units import QUANTITIES, Quantity, normalise
from crescentlab.yaml_text import Node

SIGMAS = 3.0
"""A tolerance is this many standard deviations; the normal distribution is cut off there."""

FORMS = {
    "uniform": ("uniform",), "log_uniform": ("log_uniform",), "normal": ("normal", "sd", "low", "high"),
    "triangular": ("triangular",), "nominal": ("nominal", "tolerance"), "choice": ("choice", "weights"),
}  # fmt: skip
"""Keys of each distribution, its own name first."""
WRITE = "write for example [130 um, 170 um], 150 um +- 20 um, or {normal: 150 um, sd: 10 um}"


@dataclass(frozen=True)
class Distribution:
    """Shares u in (0, 1), shape (n,) -> texts of the setting at these quantiles."""

    texts: Callable[[np.ndarray], list[str]]


@dataclass(frozen=True)
class Tolerance:
    """A nominal value and its two ends, as texts."""

    nominal: str
    low: str
    high: str


def text_of(value: float, quantity: Quantity) -> str:
    """An SI number as text that the quantity reads back to the last bit."""
    number = float(value)
    if quantity.si == "1":
        return str(int(number)) if number.is_integer() else repr(number)
    return f"{number!r} {quantity.si}"


def number(node: Node, quantity: Quantity | None, subject: str) -> float:
    """SI number of a node that must be one number of ``quantity``; raises :class:`InputError` at its line."""
    if not isinstance(node.value, str):
        raise InputError(f"{subject} must be one number, not {_kind(node)}", node.place)
    if quantity is None:
        raise InputError(f"{subject} is a word, which has no range; use it in grid or list", node.place)
    if node.value.startswith("="):
        raise InputError(f"{subject}: an expression has no place in a range; write a number with its unit", node.place)
    try:
        return quantity.parse(node.value)
    except UnitError as error:
        raise type(error)(f"{subject}: {error.message}", node.place) from None


def spread(node: Node, quantity: Quantity | None, centre: float, subject: str) -> float:
    """SI size of a deviation: with the quantity's unit, or a share of the centre in percent."""
    text = node.value if isinstance(node.value, str) else ""
    if text.strip().endswith("%") and quantity is not QUANTITIES["ratio"]:
        size = number(node, QUANTITIES["ratio"], subject) * abs(centre)
    else:
        size = number(node, quantity, subject)
        if quantity is not None and quantity.offsets:
            unit = normalise(text.lstrip("+-0123456789.eE"))
            if unit in quantity.offsets:
                raise InputError(f"{subject}: {text!r} counts from its own zero; write a difference in K", node.place)
    if size < 0:
        raise InputError(f"{subject} must not be negative, not {text!r}", node.place)
    return size


def tolerance(node: Node, quantity: Quantity | None, subject: str) -> Tolerance:
    """``150 um +- 20 um``, ``150 um +- 10 %``, ``[low, high]``, ``[low, nominal, high]``, ``{nominal, tolerance}``."""
    if isinstance(node.value, list) and len(node.value) in (2, 3):
        ends = [number(child, quantity, subject) for child in node.value]
        _rising(ends, node, subject)
        assert quantity is not None  # as number() has checked
        middle = text_of((ends[0] + ends[-1]) / 2, quantity) if len(ends) == 2 else str(node.value[1].value)
        return Tolerance(middle, str(node.value[0].value), str(node.value[-1].value))
    centre, size = _nominal(node, quantity, subject)
    assert quantity is not None
    if size == 0:
        raise InputError(f"{subject}: a tolerance of 0 varies nothing; write a larger one, or use set:", node.place)
    return Tolerance(*(text_of(value, quantity) for value in (centre, centre - size, centre + size)))


def _nominal(node: Node, quantity: Quantity | None, subject: str) -> tuple[float, float]:
    """Nominal value and tolerance, from either way of writing them."""
    if isinstance(node.value, dict):
        for key in node.value:
            if key not in FORMS["nominal"]:
                raise InputError(f"{subject}: unknown key {key!r}: {nearest(key, FORMS['nominal'])}", node.keys[key])
        for key in FORMS["nominal"]:
            if key not in node.value:
                raise InputError(f"{subject}.{key} is missing; {WRITE}", node.place)
        one, other = node.value["nominal"], node.value["tolerance"]
    else:
        parts = re.split(r"\+/?-|±", node.value) if isinstance(node.value, str) else []
        if len(parts) != 2:
            raise InputError(
                f"{subject}: not a value with its tolerance; write for example 150 um +- 20 um", node.place
            )
        one, other = (Node(part.strip(), node.place) for part in parts)
    centre = number(one, quantity, subject)
    return centre, spread(other, quantity, centre, f"{subject}: the tolerance")


def distribution(node: Node, quantity: Quantity | None, subject: str) -> Distribution:
    """The distribution that a node describes; raises :class:`InputError` at the line that is wrong."""
    if isinstance(node.value, list):
        return _frozen("uniform", node, node, quantity, subject)
    if isinstance(node.value, str):
        return _toleranced(node, quantity, subject)
    form = next((form for form in FORMS if form in node.value), None)
    if form is None:
        key = next(iter(node.value), "")
        near = f"unknown distribution {key!r}: {nearest(key, FORMS)}" if key else f"no distribution; {WRITE}"
        raise InputError(f"{subject}: {near}", node.keys.get(key) or node.place)
    for key in node.value:
        if key not in FORMS[form]:
            raise InputError(f"{subject}: unknown key {key!r} of {form}: {nearest(key, FORMS[form])}", node.keys[key])
    if form == "nominal":
        return _toleranced(node, quantity, subject)
    if form == "normal":
        return _normal(node, quantity, subject)
    if form == "choice":
        return _choice(node, quantity, subject)
    return _frozen(form, node, node.value[form], quantity, f"{subject}.{form}")


def _of(frozen: stats.distributions.rv_frozen, quantity: Quantity) -> Distribution:
    return Distribution(lambda u: [text_of(value, quantity) for value in np.asarray(frozen.ppf(u)).tolist()])


def _frozen(form: str, node: Node, ends: Node, quantity: Quantity | None, subject: str) -> Distribution:
    """Distributions known by their ends: uniform, log-uniform, triangular."""
    count = 3 if form == "triangular" else 2
    if not isinstance(ends.value, list) or len(ends.value) != count:
        example = "[low, mode, high]" if count == 3 else "[low, high]"
        raise InputError(f"{subject} needs {count} numbers: {example}", ends.place)
    values = [number(child, quantity, subject) for child in ends.value]
    _rising(values, ends, subject)
    assert quantity is not None
    low, high = values[0], values[-1]
    if form == "triangular":
        return _of(stats.triang((values[1] - low) / (high - low), low, high - low), quantity)
    if form == "log_uniform":
        if low <= 0:
            raise InputError(f"{subject} must begin above 0, for it is uniform in the logarithm", ends.place)
        return _of(stats.loguniform(low, high), quantity)
    return _of(stats.uniform(low, high - low), quantity)


def _rising(values: Sequence[float], node: Node, subject: str) -> None:
    if sorted(values) != list(values) or values[0] == values[-1]:
        raise InputError(f"{subject}: the first number must lie below the last", node.place)


def _toleranced(node: Node, quantity: Quantity | None, subject: str) -> Distribution:
    centre, size = _nominal(node, quantity, subject)
    assert quantity is not None
    if size == 0:
        return Distribution(lambda u: [text_of(centre, quantity)] * len(u))
    return _of(stats.truncnorm(-SIGMAS, SIGMAS, loc=centre, scale=size / SIGMAS), quantity)


def _normal(node: Node, quantity: Quantity | None, subject: str) -> Distribution:
    assert isinstance(node.value, dict)
    if "sd" not in node.value:
        raise InputError(f"{subject}.sd is missing (standard deviation); {WRITE}", node.place)
    mean = number(node.value["normal"], quantity, f"{subject}.normal")
    sd = spread(node.value["sd"], quantity, mean, f"{subject}.sd")
    if sd == 0:
        raise InputError(f"{subject}.sd must be above 0", node.keys["sd"])
    ends = {k: number(node.value[k], quantity, f"{subject}.{k}") for k in ("low", "high") if k in node.value}
    low, high = ends.get("low", -np.inf), ends.get("high", np.inf)
    if low >= high:
        raise InputError(f"{subject}: low must lie below high", node.place)
    assert quantity is not None
    return _of(stats.truncnorm((low - mean) / sd, (high - mean) / sd, loc=mean, scale=sd), quantity)


def _choice(node: Node, quantity: Quantity | None, subject: str) -> Distribution:
    """Words or numbers, equally likely or by weights."""
    assert isinstance(node.value, dict)
    items = node.value["choice"].value
    if not isinstance(items, list) or not items:
        raise InputError(f"{subject}.choice needs a list in brackets", node.place)
    words = [value(item, quantity, subject) for item in items]
    weights = np.ones(len(words))
    if "weights" in node.value:
        given = node.value["weights"].value
        if not isinstance(given, list) or len(given) != len(words):
            raise InputError(f"{subject}.weights needs one number for each of the {len(words)} choices", node.place)
        weights = np.array([number(w, QUANTITIES["ratio"], f"{subject}.weights") for w in given])
        if (weights < 0).any() or weights.sum() <= 0:
            raise InputError(f"{subject}.weights must not be negative, nor all 0", node.keys["weights"])
    edges = np.cumsum(weights / weights.sum())[:-1]
    return Distribution(lambda u: [words[k] for k in np.searchsorted(edges, u, side="right").tolist()])


def value(node: Node, quantity: Quantity | None, subject: str) -> str:
    """A listed value: a number of the quantity, a word, or an expression; its text as written."""
    if not isinstance(node.value, str):
        raise InputError(f"{subject} must be one text, not {_kind(node)}", node.place)
    if quantity is not None and not node.value.startswith("="):
        number(node, quantity, subject)
    return node.value


def _kind(node: Node) -> str:
    return "keys" if isinstance(node.value, dict) else "a list"
