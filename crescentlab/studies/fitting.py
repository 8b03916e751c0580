r"""Weighted nonlinear least squares with bounds: the numerics of a fit, for any model.

.. math:: \min_\theta \tfrac12 \sum_i r_i^2, \quad r_i = (y_i(\theta) - d_i)/\sigma_i, \quad
          l \le \theta \le u; \quad C = s^2 (J^T J)^{-1}, \quad J = \partial r/\partial z

d_i measured, y_i computed, \sigma_i standard deviation of a measured value; z_k = \ln \theta_k where the lower bound is
positive, otherwise \theta_k. The search works in u_k = (z_k - z(l_k))/(z(u_k) - z(l_k)), between 0 and 1, with SciPy's
trust-region reflective method. A relative \sigma_i is a share of the *computed* value, brought up to date
between searches (a share of the measured one would pull the fit towards low values); an unknown \sigma is that of its
column's residuals. s^2 = 1: every \sigma is either given or estimated. Intervals are z +- t s_z.
Sources: Branch, Coleman & Li, SIAM J. Sci. Comput. 21 (1999) 1; Carroll & Ruppert, *Transformation and Weighting in
Regression* (1988), section 2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi_squared
from scipy.stats import qmc, t

from crescentlab.errors import InputError, SimulationError
from crescentlab.studies.fit_linearity import Linearity, linearity
from crescentlab.studies.fit_scales import Data, Scale
from crescentlab.studies.identifiability import SMALLEST, Identifiability, analyse

STEP_LIMITS = (3e-3, 3e-2)
"""Smallest and largest step of the differences, in z of positive parameters, otherwise as a share of the bounds: the
smallest errs by some 1e-5 of the derivative, less than matters, and is not lost in the noise of a run."""
PROBES = 1e-3 * np.array([-2.0, -1.0, 1.0, 2.0])
"""Changes of z, all parameters together, whose fourth difference shows the noise: the true one is some 1e-12."""
TOLERANCE = 1e-5
"""Of the sum of squares and of u, where a search ends: about a hundredth of a standard error."""
COARSE = 1e-3
"""The same for a search whose weights are about to change."""
MOST_STEPS = 60
MOST_ROUNDS = 8
"""Searches with weights brought up to date."""
STILL = 0.05
"""Standard errors a parameter may move in the last round; the next one would move it less again."""
AT_BOUND = 1e-3
"""Share of the bounds' distance that counts as at a bound."""
SAME = 0.02
"""Ends of searches that differ by less, as a share of the bounds' distance, are one minimum."""
PENALTY = 1e3
"""Standard deviations that a computed value counts as wrong where the simulation fails during a search."""
NOISY = 30.0
"""Times the noise of differences that a singular value must exceed to be believed."""

Array = np.ndarray


class Model(Protocol):
    """What is fitted: computed values for parameters."""

    def computed(self, thetas: Sequence[Array]) -> Array:
        """Values of each set of parameters, shape (sets, m); NaN where the simulation failed."""

    def jacobian(self, theta: Array) -> Array | None:
        """Exact derivatives by the parameters, shape (m, p), NaN where a value has none; None where none has."""


@dataclass(frozen=True)
class Minimum:
    """Where one search ended, and how many searches ended there."""

    theta: Array
    chi2: float
    objective: float
    """chi2 + 2 sum ln sigma: -2 ln likelihood, for comparing minima."""
    starts: tuple[int, ...]


@dataclass
class Fitted:
    """A fit: parameters (p,), standard errors (p,), intervals (p, 2), computed values and sigma (m,)."""

    theta: Array
    errors: Array
    intervals: Array
    identifiability: Identifiability
    jacobian: Array
    """Of the weighted residuals by z, shape (values used, p)."""
    computed: Array
    sigma: Array
    active: Array
    """Values used: those whose simulation did not fail, shape (m,)."""
    chi2: float
    freedom: int
    """Values used less parameters."""
    estimated: bool
    """Whether any sigma is from the residuals."""
    at_bound: tuple[int, ...]
    minima: tuple[Minimum, ...]
    failed_starts: tuple[int, ...]
    method: str
    """Where derivatives come from: exact, differences, or both."""
    step: float
    noise: float
    """Noise of the computed values, as a share of the column's size; NaN if no differences were taken."""
    evaluations: int
    """Sets of parameters tried."""
    finished: bool
    """Whether the best search came to its own end."""
    linearity: Linearity
    """How far from linear the model is over the largest standard error."""

    @property
    def probability(self) -> float:
        """Probability that chi2 is at least this large if model and given uncertainties are right."""
        return float(chi_squared.sf(self.chi2, self.freedom)) if self.freedom > 0 else float("nan")


def starting_points(start: Array, scale: Scale, number: int, seed: int) -> list[Array]:
    """The given start, then a Latin hypercube between the bounds, in u."""
    inside = np.clip(scale.u(start), 1e-3, 1 - 1e-3)
    if number == 1:
        return [inside]
    return [inside, *qmc.LatinHypercube(d=start.size, seed=seed).random(number - 1)]


def too_few(values: int, parameters: int) -> str:
    """What is said of fewer values than parameters."""
    measured = f"{values} measured value{'' if values == 1 else 's'}"
    return f"{measured} cannot fix {parameters} parameters; measure more, or fit fewer"


def fit(
    model: Model, data: Data, start: Array, scale: Scale, *, starts: int = 1, seed: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Fitted:  # fmt: skip
    """Fit the model's parameters to data.

    Raises :class:`InputError` if there are fewer values than parameters, :class:`SimulationError` if every start fails.
    """
    if data.measured.size < start.size:
        raise InputError(too_few(data.measured.size, start.size))
    search = _Search(model, data, scale)
    ends: list[_End] = []
    failed: list[int] = []
    points = starting_points(start, scale, starts, seed)
    for k, u in enumerate(points):
        end = search.run(u)
        if end is None:
            failed.append(k)
        else:
            ends.append(end)
            end.starts.append(k)
        if progress is not None:
            progress((k + 1) / len(points))
    if not ends:
        raise SimulationError("the simulation failed for every row at every start; try other starts or bounds")
    return search.finished(ends, tuple(failed))


@dataclass
class _End:
    """The end of one search."""

    u: Array
    computed: Array
    slopes: Array
    """d computed / dz, shape (m, p)."""
    sigma: Array
    active: Array
    chi2: float
    finished: bool
    starts: list[int] = field(default_factory=list)

    def better_than(self, other: _End) -> bool:
        """More values computed, or as many and closer to the measured ones."""
        return (-int(self.active.sum()), self.objective) < (-int(other.active.sum()), other.objective)

    @property
    def objective(self) -> float:
        """-2 log likelihood: chi2 alone says nothing where sigma is estimated."""
        return self.chi2 + 2 * float(np.sum(np.log(self.sigma[self.active])))


class _Search:
    """Searches from several starts with one noise estimate, counting evaluations."""

    def __init__(self, model: Model, data: Data, scale: Scale) -> None:
        self.model, self.data, self.scale = model, data, scale
        self.evaluations = 0
        self.noise = float("nan")
        self.step = float("nan")
        self.methods: set[str] = set()
        self.memory: dict[bytes, Array] = {}
        self.slopes: dict[bytes, Array] = {}
        self.coarse_slopes: dict[bytes, Array] = {}
        self.sizes = np.array([data.size(k) for k in range(len(data.columns))])[data.column]

    # -- values and derivatives ------------------------------------------------------------------

    def values(self, us: Sequence[Array]) -> Array:
        """Computed values, shape (sets, m)."""
        self.evaluations += len(us)
        return self.model.computed([self.scale.of_u(u) for u in us])

    def derivatives(self, u: Array, here: Array) -> Array:
        """d computed / dz, shape (m, p): exact where the model says so, otherwise central differences."""
        theta = self.scale.of_u(u)
        exact = self.model.jacobian(theta)
        if exact is not None:
            exact = exact * np.where(self.scale.positive, theta, 1.0)
            self.methods.add("exact")
            if np.isfinite(exact[np.isfinite(here)]).all():
                return np.asarray(np.nan_to_num(exact))
        self.methods.add("differences")
        by_step = self.differences(u, here, (-1, 1))
        return by_step if exact is None else np.where(np.isfinite(exact), exact, by_step)

    def differences(self, u: Array, here: Array, sides: Sequence[int]) -> Array:
        """Differences of step h: central, one-sided if asked for, at a bound, or where one side fails."""
        if np.isnan(self.step):
            self.measure_noise(u, here)
        h = self.step * self.scale.unit / self.scale.span
        moved = np.tile(u, (u.size, 2, 1))
        for k in range(u.size):
            wanted = sides if u[k] + h[k] <= 1 else (-1, *sides)
            moved[k, :, k] = [max(u[k] - h[k], 0.0) if -1 in wanted else u[k], min(u[k] + h[k], 1.0)]
        new = [each for each in moved.reshape(-1, u.size) if not np.array_equal(each, u)]
        known = {each.tobytes(): values for each, values in zip(new, self.values(new), strict=True)}
        known[u.tobytes()] = here
        columns = []
        for k in range(u.size):
            below, above = (known[each.tobytes()] for each in moved[k])
            z_below, z_above = (moved[k, :, k] - u[k]) * self.scale.span[k]
            columns.append(_slope(below, here, above, float(z_below), float(z_above)))
        return np.stack(columns, axis=1)

    def measure_noise(self, u: Array, here: Array) -> None:
        r"""Noise from a fourth difference, and the step at which noise and curvature err alike.

        \Delta^4 of noise of standard deviation s has the variance 70 s^2 (More & Wild, SIAM J. Sci. Comput. 33 (2011)
        1292). A central difference errs by s/h + h^2/6 f'''; with f''' about f the best step is (3 s)^(1/3).
        """
        reach = self.scale.unit / self.scale.span
        at = np.clip(u, PROBES[-1] * reach, 1 - PROBES[-1] * reach)
        moved = self.values([at + change * reach for change in PROBES])
        middle = here if np.array_equal(at, u) else self.value(at)
        fourth = (moved[0] - 4 * moved[1] + 6 * middle - 4 * moved[2] + moved[3]) / self.sizes
        usable = fourth[np.isfinite(fourth)]
        self.noise = max(float(np.sqrt(np.mean(usable**2) / 70)) if usable.size else 0.0, float(np.finfo(float).eps))
        self.step = float(np.clip((3 * self.noise) ** (1 / 3), *STEP_LIMITS))

    # -- one search ------------------------------------------------------------------------------

    def run(self, u: Array) -> _End | None:
        """Search from u, with weights brought up to date; None if too little can be computed there."""
        data = self.data
        sigma = data.first_sigma()
        finished = False
        for turn in range(MOST_ROUNDS):
            active = np.isfinite(self.value(u))
            if active.sum() < u.size:
                return None
            before = u
            u, ended = self.descend(u, sigma, active, coarse=turn == 0)
            here = self.value(u)
            sigma = data.sigma(here, active, u.size)
            computable = bool((np.isfinite(here) == active).all())
            if turn > 0 and computable and (not data.reweighted or self.settled(before, u, sigma, active)):
                finished = ended
                break
        here = self.value(u)
        active = np.isfinite(here)
        residual = ((here - data.measured) / sigma)[active]
        return _End(u, here, self.slope(u), sigma, active, float(residual @ residual), finished)

    def settled(self, before: Array, u: Array, sigma: Array, active: Array) -> bool:
        """Whether no parameter has moved by a noticeable part of its standard error."""
        weighted = self.slope(u)[active] / sigma[active, None]
        errors = np.sqrt(np.diag(analyse(weighted, self.resolution).covariance))
        allowed = np.where(np.isfinite(errors), STILL * errors, AT_BOUND * self.scale.span)
        return bool(np.all(np.abs(u - before) * self.scale.span <= allowed))

    def value(self, u: Array) -> Array:
        """Computed values at u, kept."""
        key = u.tobytes()
        if key not in self.memory:
            self.memory[key] = self.values([u])[0]
        return self.memory[key]

    def slope(self, u: Array, coarse: bool = False) -> Array:
        """d computed / dz at u, kept; where a coarse one will do, by one-sided differences, the cheapest."""
        key = u.tobytes()
        if key in self.slopes:
            return self.slopes[key]
        if not coarse:
            self.slopes[key] = self.derivatives(u, self.value(u))
            return self.slopes[key]
        if key not in self.coarse_slopes:
            self.coarse_slopes[key] = self.differences(u, self.value(u), (1,))
        return self.coarse_slopes[key]

    def descend(self, u: Array, sigma: Array, active: Array, *, coarse: bool) -> tuple[Array, bool]:
        """One search of fixed weights over the active values: where it ended, and whether by itself.

        A coarse one ends early and takes one-sided differences.
        """
        tolerance = COARSE if coarse else TOLERANCE

        def residuals(at: Array) -> Array:
            r = ((self.value(at) - self.data.measured) / sigma)[active]
            return np.where(np.isfinite(r), r, PENALTY)

        def jacobian(at: Array) -> Array:
            return np.asarray(self.slope(at, coarse)[active] / sigma[active, None] * self.scale.span)

        done = least_squares(
            residuals, u, jacobian, bounds=(0.0, 1.0), method="trf", x_scale=1.0, ftol=tolerance, xtol=tolerance,
            gtol=1e-10, max_nfev=MOST_STEPS,
        )  # fmt: skip
        return np.asarray(done.x), bool(done.status > 0)

    @property
    def resolution(self) -> float:
        """Part of the largest singular value that the errors of the derivatives can make of nothing."""
        return max(SMALLEST, NOISY * self.noise / self.step) if "differences" in self.methods else SMALLEST

    # -- the end ---------------------------------------------------------------------------------

    def finished(self, ends: list[_End], failed: tuple[int, ...]) -> Fitted:
        """The best end with all that is said of it."""
        best = ends[0]
        for end in ends[1:]:
            best = end if end.better_than(best) else best
        data, scale, active = self.data, self.scale, best.active
        weighted = best.slopes[active] / best.sigma[active, None]
        found = analyse(weighted, self.resolution)
        span = scale.span
        judged = linearity(
            lambda u: np.asarray(((self.value(u) - data.measured) / best.sigma)[active]), best.u, weighted * span,
            found.covariance / np.outer(span, span),
        )  # fmt: skip
        theta, freedom = scale.of_u(best.u), int(active.sum()) - best.u.size
        estimated = bool((data.estimated & active).any())
        errors_z = np.sqrt(np.diag(found.covariance))
        reach = t.ppf(0.975, freedom if estimated and freedom > 0 else np.inf) * errors_z
        if estimated and freedom <= 0:
            reach = np.full_like(reach, np.inf)
        intervals = np.stack([_bounded(scale, scale.z(theta) - reach), _bounded(scale, scale.z(theta) + reach)], axis=1)
        at_bound = tuple(int(k) for k in np.flatnonzero((best.u < AT_BOUND) | (best.u > 1 - AT_BOUND)))
        return Fitted(
            theta=theta, errors=errors_z * np.where(scale.positive, theta, 1.0), intervals=intervals,
            identifiability=found, jacobian=weighted, computed=best.computed, sigma=best.sigma, active=active,
            chi2=best.chi2, freedom=freedom, estimated=estimated, at_bound=at_bound,
            minima=self.minima(ends), failed_starts=failed,
            method=" and ".join(sorted(self.methods, reverse=True)), step=self.step, noise=self.noise,
            evaluations=self.evaluations, finished=best.finished,
            linearity=judged,
        )  # fmt: skip

    def minima(self, ends: list[_End]) -> tuple[Minimum, ...]:
        """Different ends, the best first; ends that lie close together are one."""
        kept: list[_End] = []
        for end in sorted(ends, key=lambda e: (-int(e.active.sum()), e.objective)):
            near = next((k for k in kept if np.abs(k.u - end.u).max() < SAME), None)
            if near is None:
                kept.append(end)
            else:
                near.starts += end.starts
        return tuple(Minimum(self.scale.of_u(e.u), e.chi2, e.objective, tuple(sorted(e.starts))) for e in kept)


def _slope(below: Array, here: Array, above: Array, z_below: float, z_above: float) -> Array:
    """Slopes from values at z_below <= 0 <= z_above: central, else of the side that exists, else 0."""
    two = (above - below) / (z_above - z_below)
    left = (here - below) / -z_below if z_below < 0 else np.full_like(here, np.nan)
    right = (above - here) / z_above if z_above > 0 else np.full_like(here, np.nan)
    return np.asarray(np.nan_to_num(np.where(np.isfinite(two), two, np.where(np.isfinite(left), left, right))))


def _bounded(scale: Scale, z: Array) -> Array:
    """Parameters of z, not held within the bounds."""
    with np.errstate(over="ignore"):
        return np.where(scale.positive, np.exp(np.where(scale.positive, z, 0.0)), z)
