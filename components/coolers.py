"""Coolers: what their passages take from the pressure. Fluids are isothermal, so heat is not here."""

from .resistances import MeasuredResistance


class Cooler(MeasuredResistance):
    r"""Oil cooler as a hydraulic resistance; it takes no heat, since a fluid has one temperature.

    .. math:: p_a - p_b = R\, \frac{\rho\nu}{\rho_r \nu_r}\, Q + K \frac{\rho}{\rho_r}\, Q |Q|, \quad
              q = \frac{\rho}{\rho_0} Q

    R = `laminar` [Pa s/m^3] of the narrow passages, K = `turbulent` [Pa s^2/m^6] of headers and ports, both from the
    maker's curve of drop over flow; p [Pa] gauge, Q [m^3/s] and all else as in `measured_resistance`. A tube bundle
    known by its dimensions is a `pipe_resistance` with `parallel` tubes; the oil inside is a `capacity` beside it.
    Not for the heat transferred: give the circuit's fluid the viscosity at its temperature.
    Source: Poiseuille's law and Bernoulli's quadratic loss in series, as makers state coolers (Forchheimer, 1901).
    """
