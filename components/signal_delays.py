"""Signals sampled and delayed: sample and hold, pure delay with a buffer, pure delay approximated by Pade."""

from math import factorial

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import gives_signal, held, state, takes_signal
from crescentlab.maths import Expr, every, initially, stack
from crescentlab.units import Ratio, Time

from .signal_filters import CanonicalForm
from .signal_quantities import QuantityName


class SampleAndHold(Component):
    r"""Signal sampled at a clock and held until the next sample.

    .. math:: y(t) = u(t_k) \quad (t_k \le t < t_{k+1}), \qquad t_k = t_0 + k h

    u, y in the SI unit of `output_quantity` [1 by default]; h = `sample_time` [s]; t_0 is the start of the run, when
    the first sample is taken. Parts that sample in one instant read each other's values of before it, so a chain of
    them takes one sample time for each. Not for a converter's steps of level. Source: definition of a zero-order hold.
    """

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal")
    sample_time: Time = Field(gt=0, description="time from sample to sample")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "the sample held")
    sample = held("output_quantity", "the sample held", start=0.0)
    begun = held(Ratio, "1 once the first sample is taken", start=0.0)

    def equations(self, sample: Expr, begun: Expr, u: Expr) -> Equations:
        return {
            "y": sample,
            "begins": initially(begun == 0, sample=u, begun=1.0),
            "samples": every(self.sample_time, sample=u),
        }


class Delay(Component):
    r"""Pure delay: the input as it was some time ago, from a buffer of samples joined by straight lines.

    .. math:: y(t) = u(t - \tau)

    u, y in the SI unit of `output_quantity` [1 by default]; \tau = `delay` [s]. Samples are taken every \tau/n, n =
    `samples`. y is exact at these instants and at all times for an input of straight lines with corners there; between
    them it errs by at most (\tau/n)^2/8 max |d^2u/dt^2|, and a jump takes \tau/n to rise. Before the start the input
    was what it is then. Not for delays that vary, nor where each sample's stop costs too much: use `pade_delay`.
    Source: definition; error of linear interpolation, e.g. Stoer & Bulirsch, Numerical Mathematics, section 2.1.4.
    """

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal")
    delay: Time = Field(gt=0, description="time by which the signal is late")
    samples: int = Field(default=100, ge=1, le=10000, description="samples within the delay")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "the input of `delay` ago")
    past = held("output_quantity", "samples, oldest first", start=0.0, size="kept")
    sampled_at = held(Time, "time of the last sample", start=0.0, counts=True)
    begun = held(Ratio, "1 once the first sample is taken", start=0.0)

    @property
    def kept(self) -> int:
        """Number of samples in the buffer."""
        return self.samples + 1

    def equations(self, t: Expr, past: Expr, sampled_at: Expr, begun: Expr, u: Expr) -> Equations:
        step = self.delay / self.samples
        share = (t - sampled_at) / step
        return {
            "y": past[0] + (past[1] - past[0]) * share,
            "begins": initially(begun == 0, past=stack(*[u] * self.kept), sampled_at=t, begun=1.0),
            "samples_u": every(step, past=stack(past, u)[1:], sampled_at=t),
        }


def pade(order: int) -> tuple[list[float], list[float]]:
    """Numerator and denominator, highest power first, of the diagonal Pade approximant of exp(-s)."""
    n = order
    rising = [
        factorial(2 * n - k) * factorial(n) / (factorial(2 * n) * factorial(k) * factorial(n - k)) for k in range(n + 1)
    ]
    return [c * (-1) ** k for k, c in enumerate(rising)][::-1], rising[::-1]


class PadeDelay(Component):
    r"""Pure delay approximated by a rational function: smooth, without samples, for signals of low frequency.

    .. math:: \frac{y}{u} = \frac{P_n(-s\tau)}{P_n(s\tau)} \approx e^{-s\tau}, \qquad
              P_n(z) = \sum_{k=0}^n \frac{(2n - k)!\, n!}{(2n)!\, k!\, (n - k)!} z^k

    u, y in the SI unit of `output_quantity` [1 by default]; \tau = `delay` [s]; n = `order`. It passes all amplitudes
    and errs in phase by (n!)^2/((2n)! (2n+1)!) (\omega\tau)^{2n+1} rad to leading order: with n = 3 by 1e-5 at
    \omega\tau = 1, by 0.08 rad at 4. A jump comes through smeared, with ripples before it. Before the start the input
    was what it is then. Not for jumps and wave fronts: use `delay`. Source: G. A. Baker, P. Graves-Morris, Pade
    Approximants (2nd ed. 1996), section 1.2.
    """

    output_quantity: QuantityName = Field(default="ratio", description="quantity of the signal")
    delay: Time = Field(gt=0, description="time by which the signal is late")
    order: int = Field(default=3, ge=1, le=10, description="order of numerator and denominator")

    u = takes_signal("output_quantity", "input")
    y = gives_signal("output_quantity", "the input of about `delay` ago")
    x = state("output_quantity", "states of the canonical form", start=0.0, size="order")
    begun = held(Ratio, "1 once the start is settled", start=0.0)

    def equations(self, x: Expr, begun: Expr, u: Expr) -> Equations:
        form = CanonicalForm.of(*pade(self.order))
        return {
            "y": form.output(x, u),
            "der_x": form.rates(x, u, self.delay),
            "begins": initially(begun == 0, x=stack(u, *[0.0] * (self.order - 1)), begun=1.0),
        }
