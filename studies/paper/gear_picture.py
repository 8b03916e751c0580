"""The gears in mesh with their control volumes, drawn from the running circuit's own geometry: Figs. 2 and 3."""

from __future__ import annotations

import math

import numpy as np
from crescentlab.components.chambers import Chambers
from crescentlab.components.crescent_gears import CrescentGears
from crescentlab.components.involute import half_angle
from crescentlab.components.meshing import Meshing
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Wedge
from matplotlib.path import Path

import crescentlab as cl
from crescentlab.plotting import COLOURS
from crescentlab.report.pictures import new_figure

NU = math.radians(3.0)
"""Angle of the shaft since a trapped volume began, for which the gears are drawn."""
DELIVERY, SUCTION, CARRIED, TRAPPED = "#f2b6a0", "#b5d3ec", "#b7dfc4", "#f5e08a"
STEEL = {"facecolor": "#d9d9d9", "edgecolor": "#444444", "linewidth": 0.7}
OUTSIDE = 40e-3
"""Outer radius of the ring [m]."""


def gears_in_mesh() -> Figure:
    """The whole pair, and its mesh drawn out; the shaft turns counterclockwise, the mesh is on the right."""
    gears = cl.load("crescent_pump").design().instances["gears"].component
    assert isinstance(gears, CrescentGears)
    figure = new_figure(10.0, 5.2)
    for axes, close in zip(figure.subplots(1, 2), (False, True), strict=True):
        _draw(axes, gears.chambers, close)
    return figure


def _draw(axes: Axes, chambers: Chambers, close: bool) -> None:
    mesh = chambers.mesh
    rolls = [mesh.nu_01 + NU, mesh.nu_01 + NU + mesh.pitch]
    tangent = mesh.driver_base * np.array([math.cos(mesh.angle), -math.sin(mesh.angle)])
    along = mesh.driver_base * np.array([math.sin(mesh.angle), math.cos(mesh.angle)])
    points = np.array([tangent + y * along for y in rolls]) * 1e3
    _oil(axes, chambers, points)
    _ring(axes, chambers)
    axes.fill(*_crescent(chambers).T * 1e3, **STEEL)
    axes.fill(*_driver(chambers).T * 1e3, **STEEL)
    axes.plot(
        *np.array([tangent, tangent + 1.25 * rolls[1] * along]).T * 1e3, color="black", linewidth=0.8, linestyle="--"
    )
    axes.plot(*points.T, "o", color=COLOURS[1], markersize=5 if close else 3)
    axes.set_aspect("equal")
    axes.axis("off")
    if close:
        _name(axes, points, tangent * 1e3)
    else:
        for words, place in (
            ("suction", (-22, 21.5)),
            ("delivery", (-20, -22.5)),
            ("driver, 13 teeth", (0, 0)),
            ("driven, 16 teeth", (-6, 37.3)),
        ):
            axes.text(*place, words, horizontalalignment="center", verticalalignment="center", fontsize=9)


def _name(axes: Axes, points: np.ndarray, tangent: np.ndarray) -> None:
    for name, point in zip(("P₁", "P₂"), points, strict=True):
        axes.annotate(name, point, xytext=(7, -3), textcoords="offset points", fontsize=11, color=COLOURS[1])
    axes.annotate("T", tangent, xytext=(-12, -4), textcoords="offset points")
    axes.annotate(
        "trapped",
        points.mean(axis=0),
        xytext=(34, -40),
        textcoords="offset points",
        arrowprops={"arrowstyle": "-", "linewidth": 0.7},
    )
    axes.set(xlim=(12, 36), ylim=(-14.5, 13.5))


def _ring(axes: Axes, chambers: Chambers) -> None:
    """The driven gear: a disc with a hole of the form of its tooth spaces, which covers what lies beside the oil."""
    disc = _circle(OUTSIDE, np.linspace(0, 2 * np.pi, 361)) * 1e3 + _centre(chambers.mesh)
    hole = _spaces(chambers)[::-1] * 1e3
    axes.add_patch(PathPatch(Path.make_compound_path(*(Path(form, closed=True) for form in (disc, hole))), **STEEL))


def _oil(axes: Axes, chambers: Chambers, points: np.ndarray) -> None:
    """Colour the volumes: sectors round the driver's centre, and of the driven gear's spaces round its own."""
    mesh = chambers.mesh
    contacts = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    start, end = _carried(mesh.driver_tooth + NU, mesh.pitch, chambers.suction_end, chambers.crescent_extension)
    tau, tip, far = mesh.ratio, 1e3 * mesh.driven_tip, 1e3 * OUTSIDE
    near = far - 1e3 * mesh.eccentricity  # what this radius about the driver's centre reaches lies inside the ring
    low, high = _carried(
        mesh.driven_tooth + tau * NU,
        2 * math.pi / mesh.driven_teeth,
        chambers.suction_end / tau,
        chambers.crescent_extension / tau,
    )
    closed = math.degrees(math.pi - chambers.suction_end + chambers.crescent_extension)
    origin, centre, last = np.zeros(2), _centre(mesh), 360 + contacts[0]
    for wedge in (
        Wedge(centre, far, 0, 360, facecolor=SUCTION),
        Wedge(origin, near, closed, last, facecolor=DELIVERY),
        Wedge(origin, 1e3 * chambers.driven_root, closed, 270, facecolor=DELIVERY),
        Wedge(origin, 1e3 * mesh.driver_tip, end, closed, facecolor=DELIVERY),
        Wedge(origin, 1e3 * mesh.driver_tip, start, end, facecolor=CARRIED),
        Wedge(centre, far, high, last, width=far - tip, facecolor=DELIVERY),
        Wedge(centre, far, low, high, width=far - tip, facecolor=CARRIED),
        Wedge(origin, near, *contacts, facecolor=TRAPPED),
    ):
        wedge.set_linewidth(0)
        axes.add_patch(wedge)


def _carried(first: float, pitch: float, suction_end: float, extension: float) -> tuple[float, float]:
    """Angles [deg] between which a gear's tooth spaces are closed by the crescent: its first and last tooth there."""
    angles = first + pitch * np.arange(math.ceil(2 * math.pi / pitch) + 1)
    inside = angles[(angles >= math.pi - suction_end) & (angles <= math.pi - suction_end + extension)]
    return math.degrees(inside[0]), math.degrees(inside[-1])


def _centre(mesh: Meshing) -> np.ndarray:
    """Centre of the driven gear [mm]; the driver's is the origin."""
    return np.array([-1e3 * mesh.eccentricity, 0.0])


def _circle(radius: float, angle: np.ndarray) -> np.ndarray:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _driver(chambers: Chambers) -> np.ndarray:
    """Outline [m] of the driver: teeth from the root circle to the tip circle, flanks radial below the base circle."""
    mesh = chambers.mesh
    radius = np.linspace(chambers.driver_root, mesh.driver_tip, 12)
    half = [float(half_angle(r, mesh.driver_teeth, mesh.driver_base, mesh.pressure_angle)) for r in radius]
    tooth = np.column_stack([np.concatenate([radius, radius[::-1]]), np.concatenate([np.negative(half), half[::-1]])])
    return _around(tooth, mesh.driver_teeth, mesh.driver_tooth + NU)


def _spaces(chambers: Chambers) -> np.ndarray:
    """Inner outline [m] of the driven gear: its tooth spaces."""
    mesh = chambers.mesh
    radius = np.linspace(mesh.driven_tip, chambers.driven_root, 12)
    half = [float(half_angle(r, mesh.driven_teeth, mesh.driven_base, mesh.pressure_angle)) for r in radius]
    space = np.column_stack([np.concatenate([radius, radius[::-1]]), np.concatenate([np.negative(half), half[::-1]])])
    middle = mesh.driven_tooth + mesh.ratio * NU + math.pi / mesh.driven_teeth
    return _around(space, mesh.driven_teeth, middle) - np.array([mesh.eccentricity, 0.0])


def _around(polar: np.ndarray, count: int, first: float) -> np.ndarray:
    """A form (radius, angle) repeated round the circle, as points."""
    angles = first + 2 * math.pi / count * np.arange(count)
    return np.concatenate(
        [
            np.column_stack([polar[:, 0] * np.cos(polar[:, 1] + a), polar[:, 0] * np.sin(polar[:, 1] + a)])
            for a in angles
        ]
    )


def _crescent(chambers: Chambers) -> np.ndarray:
    """Outline [m] of the crescent between the two tip circles, over its extension about the driver's centre."""
    mesh = chambers.mesh
    angle = np.linspace(
        math.pi - chambers.suction_end, math.pi - chambers.suction_end + chambers.crescent_extension, 40
    )
    c, e = np.cos(angle), mesh.eccentricity
    outer = -e * c + np.sqrt(mesh.driven_tip**2 - e**2 * (1 - c**2))  # distance from O1 to the tip circle about O2
    inner = _circle(mesh.driver_tip, angle)
    return np.concatenate([inner, (outer[:, None] * np.column_stack([c, np.sin(angle)]))[::-1]])
