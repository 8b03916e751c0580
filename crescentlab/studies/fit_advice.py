"""Which further data would tell two parameters apart: tried on the model, not guessed.

Two kinds are tried, each as many rows as there are now: rows like the measured ones with one setting at half its
smallest or twice its largest value so far; and the same rows with one more outcome measured, the mean of one of the
circuit's outputs, as exactly as the others. The derivatives there say what correlation and what errors would be left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from crescentlab.studies.fit_model import CircuitModel
from crescentlab.studies.fit_problem import Point, Problem
from crescentlab.studies.fitting import Fitted
from crescentlab.studies.identifiability import CORRELATED, Weakness, analyse

FACTORS = (0.5, 2.0)
"""Beyond the smallest and the largest value measured so far."""
STEP = 1e-2
"""Of differences, where the fit took none."""
MOST_OUTCOMES = 10
SHARE = 0.05
"""Standard deviation of a further outcome over its value, where no measured column tells one."""
WORTH = 2.0
"""An error that shrinks by less is not worth a sentence: as many rows again alone make it 1.4 times smaller."""

Array = np.ndarray


@dataclass(frozen=True)
class Candidate:
    """What could be measured besides, in words, and d computed / dz over sigma of it."""

    text: str
    slopes: Array
    """Shape (values, p), weighted as many rows as there are now."""


class Adviser:
    """Tries further data on the model; candidates are simulated once."""

    def __init__(self, problem: Problem, model: CircuitModel, fitted: Fitted) -> None:
        self.problem, self.model, self.fitted = problem, model, fitted
        self._candidates: list[Candidate] | None = None
        points = problem.points
        self.like = [points[k] for k in sorted({0, len(points) // 2, len(points) - 1})]
        """Runs that candidates are like: the first, the middle and the last."""

    def advice(self, weakness: Weakness) -> str:
        """What would tell the members of a weakness apart."""
        if len(weakness.members) < 2:
            return "take it out of parameters:, or measure something that depends on it"
        if self.problem.times is not None:
            return self.further(weakness)
        judged = [(self.strength(c, weakness.members), c) for c in self.candidates]
        strength, best = min(judged, key=lambda each: each[0], default=(1.0, None))
        if best is not None and strength < CORRELATED:
            return f"{best.text} as well would bring the correlation to {strength:.2f}"
        return self.further(weakness)

    def further(self, weakness: Weakness) -> str:
        """What would shrink the error of the worst member most."""
        fix = "fix one of them (move it from parameters: to set:)"
        if self.problem.times is not None:
            return f"measure another variable, excite the circuit otherwise, or {fix}"
        name, factor, best = self.shrinking(weakness.members)
        if best is None:
            return f"none of {len(self.candidates)} further settings and outcomes tells them apart; {fix}"
        return f"{best.text} as well would make the standard error of {name} {factor:.2g} times smaller"

    def strength(self, candidate: Candidate, members: Sequence[int]) -> float:
        """Largest |correlation| of the members if the candidate were measured."""
        found = analyse(np.vstack([self.fitted.jacobian, candidate.slopes]))
        return max(abs(float(found.correlation[a, b])) for a, b in combinations(members, 2))

    def shrinking(self, members: Sequence[int]) -> tuple[str, float, Candidate | None]:
        """The member worst determined, by what its error would shrink at best, and by which candidate."""
        now = np.diag(self.fitted.identifiability.covariance)
        worst = max(members, key=lambda k: now[k])
        factor, best = WORTH, None
        for candidate in self.candidates:
            then = np.diag(analyse(np.vstack([self.fitted.jacobian, candidate.slopes])).covariance)[worst]
            if np.isfinite(now[worst]) and np.isfinite(then) and np.sqrt(now[worst] / then) > factor:
                factor, best = float(np.sqrt(now[worst] / then)), candidate
        return self.problem.parameters[worst].name, factor, best

    @property
    def candidates(self) -> list[Candidate]:
        """What was tried and could be simulated."""
        if self._candidates is None:
            self._candidates = [*self.other_settings(), *self.other_outcomes()]
        return self._candidates

    # -- candidates ------------------------------------------------------------------------------

    def other_settings(self) -> list[Candidate]:
        """Rows at settings beyond those measured."""
        found: list[Candidate] = []
        for column, name in self.problem.file.settings.items():
            values = self.problem.table.plain(column)
            if values is None:
                continue
            for value in dict.fromkeys((FACTORS[0] * float(values.min()), FACTORS[1] * float(values.max()))):
                text = f"{value:.3g} {self.problem.table.columns[column].unit}".strip()
                slopes = self.slopes([self.moved(point, name, text) for point in self.like])
                if slopes is not None:
                    found.append(Candidate(f"measuring at {column} = {text}", slopes))
        return found

    def other_outcomes(self) -> list[Candidate]:
        """The measured rows with one more outcome."""
        system = self.problem.circuit.system(self.model.settings(self.like[0], self.fitted.theta))
        outputs = [o.name for o in self.problem.circuit.design(self.like[0].settings).outputs if not o.scope]
        known = {each.outcome.text.replace(" ", "") for each in self.problem.measured}
        texts = [f"mean({name})" for name in outputs if not system.variables[name].vector]
        texts = [text for text in texts if text not in known][:MOST_OUTCOMES]
        found: list[Candidate] = []
        slopes = self.slopes(self.like, texts) if texts else None
        if slopes is None:
            return []
        columns, rows = len(self.problem.measured), len(slopes) // (len(self.problem.measured) + len(texts))
        by_row = slopes.reshape(rows, columns + len(texts), -1)
        for k, text in enumerate(texts):
            if np.isfinite(by_row[:, columns + k]).all():
                found.append(Candidate(f"measuring {text}", by_row[:, columns + k]))
        return found

    @staticmethod
    def moved(point: Point, name: str, text: str) -> Point:
        """A point with one setting replaced."""
        return replace(point, settings={**point.settings, name: text})

    def slopes(self, points: Sequence[Point], more: Sequence[str] = ()) -> Array | None:
        """d computed / dz over sigma of further rows, one of each point; None if none can be simulated."""
        unique = [p for k, p in enumerate(points) if p.settings not in [q.settings for q in points[:k]]]
        thetas = self.thetas()
        work = [(replace(point, rows=point.rows[:1]), theta) for point in unique for theta in thetas]
        made = self.model.run(work, more)
        rows: list[Array] = []
        for k in range(len(unique)):
            values = made[k * len(thetas) : (k + 1) * len(thetas)]
            if not any(isinstance(v, str) for v in values):
                rows.append(self.of_point(np.array([np.asarray(v)[0] for v in values])))
        if not rows:
            return None
        return np.asarray(np.sqrt(self.problem.table.rows / len(rows)) * np.concatenate(rows))

    def thetas(self) -> list[Array]:
        """The solution, and each parameter below and above it."""
        scale, theta = self.problem.scale, self.fitted.theta
        step = self.fitted.step if np.isfinite(self.fitted.step) else STEP
        found = [theta]
        for k in range(theta.size):
            for side in (-1, 1):
                z = scale.z(theta)
                z[k] += side * step * scale.unit[k]
                found.append(scale.theta(z))
        return found

    def of_point(self, values: Array) -> Array:
        """d computed / dz over sigma from values at :meth:`thetas`, shape (columns, p)."""
        thetas, scale = self.thetas(), self.problem.scale
        columns = []
        for k in range(self.fitted.theta.size):
            width = float(scale.z(thetas[2 * k + 2])[k] - scale.z(thetas[2 * k + 1])[k])
            columns.append((values[2 * k + 2] - values[2 * k + 1]) / width)
        with np.errstate(all="ignore"):
            return np.asarray(np.stack(columns, axis=1) / self.sigma(values[0])[:, None])

    def sigma(self, computed: Array) -> Array:
        """Standard deviations of a further row: as those of the measured ones; of other outcomes a usual share."""
        data = self.problem.data
        shares: list[float] = []
        found = np.zeros(computed.size)
        for k in range(len(self.problem.measured)):
            of = data.column == k
            if not of.any():
                found[k] = np.inf
                continue
            share = float(data.share[of][0])
            middle = float(np.median(self.fitted.sigma[of]))
            shares.append(share if np.isfinite(share) else middle / data.size(k))
            found[k] = share * abs(computed[k]) if np.isfinite(share) else middle
        usual = max(shares, default=SHARE)
        found[len(self.problem.measured) :] = usual * np.abs(computed[len(self.problem.measured) :])
        return found
