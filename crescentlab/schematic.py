"""A circuit as a picture: components as boxes, nets as dots with names, one colour per domain."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx as nx

from crescentlab.domain import State
from crescentlab.elaborate import DesignNet, PortRef
from crescentlab.errors import InputError
from crescentlab.files import check_writable
from crescentlab.graph import Graph
from crescentlab.placement import place

SUFFIXES = (".svg", ".png", ".pdf")
COLOURS = {
    "hydraulic": "#0072B2", "translational": "#D55E00", "rotational": "#009E73", "chamber": "#AA4499",
    "signal": "#777777",
}  # fmt: skip
TINTS = ("#FFF6DD", "#E7F3EC", "#F4E9F4", "#E6F1FA", "#FBE9E1")
"""Fills of subcircuits, so that their components are seen to belong together."""
INK = "#222222"
MANY = 5
"""From so many ports on, a net held by a boundary (a tank) is drawn at each of them instead of once."""
CHARACTER = 0.082
"""Width of a character of a box's name [inch]."""


@dataclass(frozen=True)
class Line:
    """From a component to a net's dot."""

    component: Hashable
    net: Hashable
    port: str
    domain: str
    role: str


@dataclass(frozen=True)
class Sheet:
    """What is drawn: texts of boxes and dots, and the lines between them."""

    boxes: dict[Hashable, tuple[str, str]]
    dots: dict[Hashable, tuple[str, str]]
    lines: list[Line]


def check_target(path: Path) -> None:
    """Refuse a picture that cannot be written."""
    said = f"a schematic is {', '.join(SUFFIXES)}; write for example -o {path.stem or 'circuit'}.svg"
    check_writable(path, SUFFIXES, said)


def draw(graph: Graph, path: Path) -> None:
    """Write the schematic of a circuit; the suffix chooses the format."""
    sections = graph.design.netlist.sections
    figure = _figure(sheet(graph), sections.title or graph.design.netlist.name)
    import matplotlib as mpl

    try:
        with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "crescentlab"}):
            figure.savefig(path, dpi=130, metadata={"Date": None} if path.suffix == ".svg" else None)
    except OSError as error:
        raise InputError(f"-o {path}: cannot be written ({error.strerror})") from None


def sheet(graph: Graph) -> Sheet:
    """Boxes, dots and lines of a circuit; a vector net is one dot."""
    design = graph.design
    boxes: dict[Hashable, tuple[str, str]] = {
        ("component", name): (name, type(i.component).type_name()) for name, i in design.instances.items()
    }
    dots: dict[Hashable, tuple[str, str]] = {}
    lines: list[Line] = []
    for net in design.nets:
        local = _is_boundary(graph, net)
        for k, ref in enumerate(net.ports):
            dot = ("net", net.name, k if local else 0)
            dots[dot] = (net.name, ref.port.domain.name)
            lines.append(Line(("component", ref.instance), dot, _port(ref), ref.port.domain.name, ref.port.role))
    return Sheet(boxes, dots, lines)


def _is_boundary(graph: Graph, net: DesignNet) -> bool:
    """Whether a part without states, such as a tank, holds a net of many ports: then lines to it say little."""
    givers = [graph.design.instances[ref.instance].component for ref in net.ports if ref.port.role == "gives"]
    fixed = [c for c in givers if len(type(c).ports()) == 1 and not type(c).declared(State)]
    return len(net.ports) >= MANY and bool(fixed)


def _port(ref: PortRef) -> str:
    return ref.port.name + (f"[{ref.element}]" if ref.element is not None else "")


# -- drawing -------------------------------------------------------------------------------------


def _figure(shown: Sheet, title: str) -> Any:
    from matplotlib.figure import Figure

    sizes = {
        n: (max(len(name) * CHARACTER, len(kind) * 0.85 * CHARACTER) + 0.16, 0.4)
        for n, (name, kind) in shown.boxes.items()
    }
    sizes |= {n: (len(name) * 0.8 * CHARACTER + 0.08, 0.36) for n, (name, _) in shown.dots.items()}
    graph: nx.Graph[Hashable] = nx.Graph()
    graph.add_nodes_from(sizes)
    graph.add_edges_from((line.component, line.net) for line in shown.lines)
    places = place(graph, sizes)
    x = [p[0] + s * sizes[n][0] / 2 for n, p in places.items() for s in (-1, 1)] or [0.0]
    y = [p[1] + s * sizes[n][1] / 2 for n, p in places.items() for s in (-1, 1)] or [0.0]
    left, right, low, high = min(x) - 0.3, max(max(x) + 0.3, min(x) + 5.0), min(y) - 0.75, max(y) + 0.6
    figure = Figure(figsize=(right - left, high - low), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(left, right), ylim=(low, high))
    axes.set_axis_off()
    _draw_lines(axes, shown, places, sizes)
    _draw_boxes(axes, shown, places, sizes)
    _draw_dots(axes, shown, places)
    axes.text(left + 0.2, high - 0.2, title, fontsize=12, fontweight="bold", va="top", color=INK)
    _draw_legend(axes, shown, left + 0.2, low + 0.25)
    return figure


def _draw_lines(axes: Any, shown: Sheet, places: Any, sizes: Any) -> None:
    joined: dict[Any, int] = {}
    texts: list[tuple[float, float, float]] = []
    for line in shown.lines:
        (x0, y0), (x1, y1) = places[line.component], _dot(places[line.net])
        joined[line.component, line.net] = joined.get((line.component, line.net), -1) + 1
        shift = 0.09 * joined[line.component, line.net]  # a second port of one component on the same net
        style = {"linestyle": (0, (3, 2))} if line.role == "reads" else {}
        width = 2.4 if line.role == "gives" else 1.1
        axes.plot(
            [x0 + shift, x1],
            [y0, y1],
            color=COLOURS[line.domain],
            linewidth=width,
            zorder=1,
            solid_capstyle="round",
            **style,
        )
        tx, ty = _beside(x0 + shift, y0, x1, y1, sizes[line.component], len(line.port) * 0.025 + 0.03, texts)
        axes.text(
            tx, ty, line.port, fontsize=5.5, color=COLOURS[line.domain], ha="center", va="center", zorder=4,
            bbox={"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none"},
        )  # fmt: skip


def _beside(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    size: tuple[float, float],
    half: float,
    texts: list[tuple[float, float, float]],
) -> tuple[float, float]:
    """Where a port's name stands on its line: just outside the box, further out where other names stand."""
    dx, dy = x1 - x0, y1 - y0
    first = min((size[0] / 2 + half) / max(abs(dx), 1e-9), (size[1] / 2 + 0.07) / max(abs(dy), 1e-9), 0.6)
    step = 0.06 / max((dx * dx + dy * dy) ** 0.5, 1e-9)
    for k in range(8):
        share = min(first + k * step, 0.8)
        x, y = x0 + share * dx, y0 + share * dy
        if all(abs(x - tx) > half + other or abs(y - ty) > 0.1 for tx, ty, other in texts):
            break
    texts.append((x, y, half))
    return x, y


def _draw_boxes(axes: Any, shown: Sheet, places: Any, sizes: Any) -> None:
    from matplotlib.patches import FancyBboxPatch

    parts = list(dict.fromkeys(name.partition(".")[0] for name, _ in shown.boxes.values() if "." in name))
    for node, (name, kind) in shown.boxes.items():
        (x, y), (width, height) = places[node], sizes[node]
        fill = TINTS[parts.index(name.partition(".")[0]) % len(TINTS)] if "." in name else "white"
        axes.add_patch(
            FancyBboxPatch(
                (x - width / 2, y - height / 2), width, height, boxstyle="round,pad=0,rounding_size=0.06",
                facecolor=fill, edgecolor=INK, linewidth=1.0, zorder=3,
            )
        )  # fmt: skip
        axes.text(x, y + 0.08, name, fontsize=8.5, fontweight="bold", ha="center", va="center", color=INK, zorder=5)
        axes.text(x, y - 0.09, kind, fontsize=7, ha="center", va="center", color="#555555", zorder=5)


def _dot(place: tuple[float, float]) -> tuple[float, float]:
    """A net's dot stands under its name."""
    return place[0], place[1] - 0.1


def _draw_dots(axes: Any, shown: Sheet, places: Any) -> None:
    for node, (name, domain) in shown.dots.items():
        x, y = _dot(places[node])
        axes.plot([x], [y], "o", color=COLOURS[domain], markersize=6, zorder=6)
        axes.text(
            x, y + 0.17, name, fontsize=7, fontstyle="italic", ha="center", va="center", color=COLOURS[domain],
            zorder=7, bbox={"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        )  # fmt: skip


def _draw_legend(axes: Any, shown: Sheet, x: float, y: float) -> None:
    """Domains that occur, then the kinds of lines."""
    present = {domain for _, domain in shown.dots.values()}
    entries: list[tuple[str, str, dict[str, Any]]] = [
        (d, c, {"linewidth": 1.6}) for d, c in COLOURS.items() if d in present
    ]
    entries.append(("gives", INK, {"linewidth": 2.4}))
    entries.append(("takes", INK, {"linewidth": 1.1}))
    if any(line.role == "reads" for line in shown.lines):
        entries.append(("reads", INK, {"linewidth": 1.1, "linestyle": (0, (3, 2))}))
    for text, colour, style in entries:
        axes.plot([x, x + 0.25], [y, y], color=colour, **style)
        axes.text(x + 0.32, y, text, fontsize=7.5, va="center", color=INK)
        x += 0.55 + len(text) * 0.07
