"""Compares the flat equations with the assembled circuit: term by term at drawn states, and over whole runs."""

from __future__ import annotations

import ctypes

import casadi as ca
import numpy as np

from .driver import Array, Build, pointer
from .parameters import segments, tick_of

OWN = np.eye(16)
"""From the circuit's states to those of C: the duct's two flows instead of their mean and difference."""
OWN[10:12, 10:12] = [[1, 0.5], [1, -0.5]]


def terms(build: Build, speed: str, area: str | None, draws: int = 200, seed: int = 1) -> dict[str, float]:
    """Largest relative difference of f, df/dx, df/dt, a solution with the factors, and a tick's nodes; each entry of a
    vector against its own size, where the states are measured by their nominal values."""
    point, system, values = build.point(speed, area)
    rng, names, design = np.random.default_rng(seed), system.held_names, build.circuit.design()
    jacobian = ca.Function(
        "J", system.arguments, [ca.densify(system.jacobian_expression), ca.jacobian(system.f, system.t)]
    )
    nominal = system.nominal
    fired = np.zeros(len(system.events))
    fired[[event.name for event in system.events].index("line.pipe.tick")] = 1
    worst = dict.fromkeys(("f", "df/dx", "df/dt", "solution", "nodes"), 0.0)
    for _ in range(draws):
        place, x, h, p, q = _draw(rng, point[0], values, names, design)
        b = np.zeros(system.b.numel())
        for _ in range(3):
            g = system.relation.function(place[0], x, h, b, np.zeros(16), system.relation.parameters(values.p))[0]
            b = (np.array(g).ravel() > 0).astype(float)
        f = OWN @ np.array(system.rhs.function(place[0], x, h, b, system.rhs.parameters(values.p))).ravel()
        dfdx, dfdt = (np.array(a) for a in jacobian(place[0], x, h, b, values.p))
        dfdt = OWN @ (dfdt.ravel() + dfdx[:, 0] * point[0])
        dfdx = OWN @ dfdx @ np.linalg.inv(OWN)
        dfdx[:, 0] = 0
        g = 1 / (5e-5 * 0.25)
        mine = [np.zeros(n) for n in (16, 256, 16, 16, 11, 11)]
        build.library.limit_look(*map(pointer, (point, x, p, q, place)), ctypes.c_double(g), *map(pointer, mine))
        matrix, right = g * np.eye(16) - dfdx, f.copy()
        if place[3]:
            matrix[7, 8], right[7:9] = 0, 0
        after = np.array(system.remap.function(place[0], x, h, b, fired, system.remap.parameters(values.p))[1]).ravel()
        first = names.index("line.pipe.p_node[1]")
        pairs = {
            "f": (mine[0] / nominal, f / nominal),
            "df/dx": (mine[1].reshape(16, 16) * nominal / nominal[:, None], dfdx * nominal / nominal[:, None]),
            "df/dt": (mine[2] / nominal, dfdt / nominal),
            "solution": (mine[3] / nominal, np.linalg.solve(matrix, right) / nominal),
            "nodes": (np.concatenate(mine[4:]), after[first : first + 22]),
        }
        for name, (ours, theirs) in pairs.items():
            floor = 1e-12 * np.max(np.abs(theirs)) if name != "nodes" else 0.0
            far = np.abs(ours - theirs) / np.maximum(np.abs(theirs), floor)
            worst[name] = max(worst[name], float(np.nanmax(far)))
    return worst


def _draw(rng: np.random.Generator, omega: float, values, names, design):  # type: ignore[no-untyped-def]
    """Somewhere in a pitch: (t, segment, pitches, spool at, t_node, had_a, had_b), states, held values, nodes."""
    cuts, pitch = segments(design)
    begins = [*(row[0] for row in cuts), pitch]
    k, turns = int(rng.integers(len(cuts))), int(rng.integers(20))
    phi = turns * pitch + begins[k] + rng.uniform(0.01, 0.99) * (begins[k + 1] - begins[k])
    t, at, x, h = phi / omega, float(rng.choice([-1, 0, 0])), values.x0.copy(), values.h0.copy()
    x[:7] = phi, *rng.uniform([1e5, -1.5e4, 0, 0, -1e4, -1e4], [9e5, 1e4, 3e6, 5e5, 5e5, 5e5])
    lift = [rng.uniform(0, 2e-3), rng.uniform(0, 2e-6), -1e-5][int(rng.integers(3))]
    x[7:9] = (0, 0) if at else (lift, rng.uniform(-0.1, 0.1))
    x[9:] = (
        x[1] + rng.uniform(-1e4, 1e4),
        *rng.uniform([-1e-4, -1e-4, 1e5, 0, 0, 1e5], [1e-3, 1e-4, 9e5, 1e-7, 1e-7, 9e5]),
    )
    p = rng.uniform(2e5, 9e5) + rng.uniform(-1e4, 1e4, 11)
    q = rng.uniform(1e-4, 1e-3) + rng.uniform(-1e-5, 1e-5, 11)
    tick = tick_of(design)
    elapsed = rng.uniform(0, tick)
    had = x[13] - q[0] * tick, x[14] + q[-1] * tick
    chambers = design.instances["gears"].component.chambers
    held = {
        "gears.mesh_start": turns * pitch,
        "gears.started": 1,
        "relief.spool.at": at,
        "line.pipe.t_node": t - elapsed,
    }
    for gear, closes in (("driver", chambers.driver_closes), ("driven", chambers.driven_closes)):
        phase = phi + float(-closes % pitch)
        held |= {f"{gear}.closed_at": phase - phase % pitch, f"{gear}.started": 1}
    held |= {"line.pipe.had_a": had[0], "line.pipe.had_b": had[1]}
    for name, value in held.items():
        h[names.index(name)] = value
    first = names.index("line.pipe.p_node[1]")
    h[first : first + 22] = *p, *q
    return np.array([t, k, turns, at, t - elapsed, *had]), x, h, p, q


def order(build: Build, method: str, span: float = 4e-6) -> float:
    """Order observed as equal steps are halved over a smooth piece, from where the last run ended."""
    nominal = build.circuit.system().nominal
    exact = build.fixed(method, 2048, span)
    far = [float(np.linalg.norm((build.fixed(method, n, span) - exact) / nominal)) for n in (8, 16)]
    return float(np.log2(far[0] / far[1]))


def difference(p: Array, reference: Array) -> float:
    """max |p - p_ref| / mean(p_ref)."""
    n = min(p.size, reference.size)
    return float(np.max(np.abs(p[:n] - reference[:n])) / np.mean(reference[:n]))
