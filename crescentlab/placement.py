"""Places for the boxes of a drawing: near what they are joined to, apart from all others, lines crossing rarely.

A layout by graph distance (Kamada and Kawai) is the start; boxes that overlap are pushed apart; then
single boxes are moved or swapped as long as that makes the drawing better. The same graph always gives
the same drawing.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import networkx as nx
import numpy as np

Places = dict[Hashable, tuple[float, float]]
Sizes = Mapping[Hashable, tuple[float, float]]

STRETCH = 1.5
"""Boxes are wide, so drawings are too."""
LENGTH = 1.15
"""Mean length of a line [inch]."""
GAP = 0.14
"""Least distance of boxes [inch]."""
MOVES = 100
"""Attempts to improve per box, ..."""
MOST_MOVES = 3600
"""... and in all."""
LARGE = 250
"""Above this number of boxes the quick layout has to do."""


def place(graph: nx.Graph[Hashable], sizes: Sizes) -> Places:
    """Centres of boxes of the given sizes (width, height) [inch]; disconnected parts stand side by side."""
    shown: Places = {}
    left = 0.0
    for nodes in sorted(nx.connected_components(graph), key=len, reverse=True):
        part = graph.subgraph(nodes)
        spots = _part(part, sizes)
        low = min(x - sizes[n][0] / 2 for n, (x, _) in spots.items())
        shown.update({n: (x - low + left, y) for n, (x, y) in spots.items()})
        left = max(shown[n][0] + sizes[n][0] / 2 for n in spots) + 4 * GAP
    return shown


def _part(graph: nx.Graph[Hashable], sizes: Sizes) -> Places:
    nodes = sorted(graph.nodes, key=str)
    if len(nodes) == 1:
        return {nodes[0]: (0.0, 0.0)}
    size = np.array([sizes[n] for n in nodes])
    index = {n: k for k, n in enumerate(nodes)}
    lines = np.array([(index[a], index[b]) for a, b in graph.edges])
    ordered: nx.Graph[Hashable] = nx.Graph()
    ordered.add_nodes_from(nodes)
    ordered.add_edges_from(sorted(graph.edges, key=str))
    if len(nodes) > LARGE:
        starts = [nx.spring_layout(ordered, seed=1)]
    else:
        starts = [
            nx.kamada_kawai_layout(ordered, pos=start)
            for start in (nx.circular_layout(ordered), _jittered(nx.spectral_layout(ordered)))
        ]
    drawn = [_spread(np.array([start[n] for n in nodes]), size, lines) for start in starts]
    at = min(drawn, key=lambda each: _Improving(each, size, lines).cost())
    if len(nodes) <= LARGE:
        at = _apart(_Improving(at, size, lines).run(), size)
    return {n: (float(x), float(y)) for n, (x, y) in zip(nodes, at, strict=True)}


def _jittered(start: dict[Hashable, np.ndarray]) -> dict[Hashable, np.ndarray]:
    """A start in which no two stand in the same place."""
    chance = np.random.default_rng(3)
    return {n: at + chance.normal(0, 1e-3, 2) for n, at in start.items()}


def _spread(at: np.ndarray, size: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """A layout in inches, turned to be wide, without overlaps."""
    at = _turned(at)
    mean = float(np.mean(np.hypot(*(at[lines[:, 0]] - at[lines[:, 1]]).T)))
    return _apart(at * LENGTH / max(mean, 1e-9) * (STRETCH, 1.0), size)


def _turned(at: np.ndarray) -> np.ndarray:
    """Turned so that it is as wide as can be."""
    centred = at - at.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return np.asarray(centred @ axes.T)


def _apart(at: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Push overlapping boxes apart, along the direction that needs less."""
    at = at.copy()
    need = (size[:, None, :] + size[None, :, :]) / 2 + GAP
    apart = np.arange(len(at))[:, None] != np.arange(len(at))[None, :]
    for _ in range(400 if len(at) <= LARGE else 60):
        gap = at[:, None, :] - at[None, :, :]
        over = need - np.abs(gap)
        clash = (over > 1e-6).all(axis=2) & apart
        if not clash.any():
            break
        sideways = over[..., 0] < over[..., 1]
        away = np.where(gap == 0, np.sign(np.arange(len(at))[:, None] - np.arange(len(at)))[..., None], np.sign(gap))
        push = np.stack(
            [np.where(clash & sideways, over[..., 0], 0), np.where(clash & ~sideways, over[..., 1], 0)], axis=2
        )
        at += 0.3 * (away * push).sum(axis=1)
    return at


class _Improving:
    """Moves and swaps of single boxes while the cost falls: crossings, lines through boxes, overlaps, length."""

    def __init__(self, at: np.ndarray, size: np.ndarray, lines: np.ndarray) -> None:
        self.at, self.size, self.lines = at.copy(), size, lines
        self.of = [np.flatnonzero((lines == k).any(axis=1)) for k in range(len(at))]

    def cost(self) -> float:
        """Cost of the whole drawing."""
        every = np.arange(len(self.lines))
        return self.of_lines(every) / 2 + self.of_boxes(np.arange(len(self.at))) / 2

    def run(self) -> np.ndarray:
        """Try random moves, fewer and shorter towards the end; keep what helps."""
        chance = np.random.default_rng(7)
        count = len(self.at)
        moves = min(MOVES * count, MOST_MOVES)
        for turn in range(moves):
            one = int(chance.integers(count))
            reach = 2.5 * (1 - turn / moves) + 0.1
            if chance.random() < 0.25:
                other = int(chance.integers(count))
                self.attempt([one, other], self.at[[other, one]])
            else:
                self.attempt([one], self.at[[one]] + chance.normal(0, reach, 2) * (STRETCH, 1.0))
        return self.at

    def attempt(self, moved: list[int], to: np.ndarray) -> None:
        lines = np.unique(np.concatenate([self.of[k] for k in moved]))
        which = np.array(moved)
        before, old = self.of_lines(lines) + self.of_boxes(which), self.at[which].copy()
        self.at[which] = to
        if self.of_lines(lines) + self.of_boxes(which) >= before:
            self.at[which] = old

    def of_lines(self, which: np.ndarray) -> float:
        """Cost of some lines: length, crossings, boxes they run through."""
        a, b = self.at[self.lines[which, 0]], self.at[self.lines[which, 1]]
        length = np.hypot(*(a - b).T)
        long = np.maximum(length - LENGTH, 0)
        return float(
            0.25 * length.sum()
            + 0.2 * (long**2).sum()
            + 2.0 * self.crossings(which, a, b)
            + 3.0 * self.hits(np.arange(len(self.at)), which)
        )

    def crossings(self, which: np.ndarray, a: np.ndarray, b: np.ndarray) -> int:
        c, d = self.at[self.lines[:, 0]], self.at[self.lines[:, 1]]
        shared = (self.lines[which][:, None, :, None] == self.lines[None, :, None, :]).any(axis=(2, 3))
        a, b, c, d = a[:, None], b[:, None], c[None], d[None]
        sides = (_turn(a, b, c) * _turn(a, b, d) < 0) & (_turn(c, d, a) * _turn(c, d, b) < 0)
        return int((sides & ~shared).sum())

    def of_boxes(self, which: np.ndarray) -> float:
        """Cost of some boxes: overlaps with others, and lines of others that run through them."""
        over = (self.size[which][:, None] + self.size[None]) / 2 + GAP - np.abs(self.at[which][:, None] - self.at[None])
        clash = np.clip(over, 0, None).prod(axis=2)
        clash[np.arange(len(which)), which] = 0
        return float(20.0 * clash.sum()) + 3.0 * self.hits(which, np.arange(len(self.lines)))

    def hits(self, boxes: np.ndarray, lines: np.ndarray) -> int:
        """How often lines run through boxes without ending there."""
        a, b = self.at[self.lines[lines, 0]], self.at[self.lines[lines, 1]]
        half = self.size[boxes][None] / 2 + 0.04
        step = (b - a)[:, None, :]
        step = np.where(np.abs(step) < 1e-9, 1e-9, step)
        near, far = (self.at[boxes][None] - half - a[:, None]) / step, (self.at[boxes][None] + half - a[:, None]) / step
        enters, leaves = np.minimum(near, far).max(axis=2), np.maximum(near, far).min(axis=2)
        ends = (self.lines[lines][:, :, None] == boxes[None, None, :]).any(axis=1)
        return int(((enters < leaves) & (leaves > 0) & (enters < 1) & ~ends).sum())


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the area of the triangle a b c, positive if it turns left."""
    return np.asarray(
        (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
    )
