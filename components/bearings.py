"""Estimates for hydrodynamic journal bearings, for choosing parameters of gaps. Pure functions, no components here.

They work on floats, in SI. Nothing in a circuit calls them: the paper too uses the estimate once, to choose a constant.
"""

from crescentlab.maths import pi, sin, sqrt

HALVINGS = 60
"""Halvings of the interval 0 ... 1 in which the eccentricity ratio is searched: to the last digit of a float."""


def gear_side_load(pressure: float, tip_radius: float, thickness: float, arc: float) -> float:
    r"""Load [N] on a gear's bearing from a pressure that acts on an `arc` of its circumference, none on the rest.

    .. math:: W = p H \cdot 2 R \sin(\alpha/2)

    p = `pressure` [Pa, gauge]; H = `thickness`, R = `tip_radius` [m]; \alpha = `arc` [rad]: the pressure times the
    gear projected on a plane. Largest at half a turn, 2 p H R. Left out: the pressures along the crescent, between
    those two, and the force between the teeth (torque over base radius, a tenth of W in a small pump).
    Source: resultant of a uniform pressure on an arc.
    """
    return pressure * thickness * 2 * tip_radius * float(sin(arc / 2))


def sommerfeld_number(
    load: float, speed: float, viscosity: float, diameter: float, length: float, clearance: float
) -> float:  # fmt: skip
    r"""Sommerfeld number [-] of a journal bearing.

    .. math:: S = \frac{\mu n D L}{W} \left(\frac{D}{2c}\right)^2, \quad n = \frac{\omega}{2\pi}

    \mu = `viscosity` [Pa s]; \omega = `speed` [rad/s]; D = `diameter`, L = `length`, c = `clearance` [m], radial;
    W = `load` [N]. Source: Norton, Machine Design; DuBois & Ocvirk, NACA Report 1157 (1953).
    """
    return viscosity * speed / (2 * pi) * diameter * length / load * (diameter / (2 * clearance)) ** 2


def short_bearing_sommerfeld(eccentricity: float, slenderness: float) -> float:
    r"""Sommerfeld number [-] at which a short bearing runs with the eccentricity ratio.

    .. math:: S \left(\frac{L}{D}\right)^2 = \frac{(1-\varepsilon^2)^2}
              {\pi \varepsilon \sqrt{\pi^2 (1-\varepsilon^2) + 16 \varepsilon^2}}

    \varepsilon = `eccentricity` [-], offset of the axes over the radial clearance, above 0; L/D = `slenderness` [-].
    Ocvirk's solution leaves out the flow round the journal that the pressure drives: for L/D up to 1/2. Above
    \varepsilon = 0.8 it carries too much load (a fifth at L/D = 1/4), so real journals run closer to the wall.
    Source: DuBois & Ocvirk, NACA Report 1157 (1953); used in Rundo & Corvaglia (2016), section 2.2.
    """
    slack = 1 - eccentricity**2
    root = float(sqrt(pi**2 * slack + 16 * eccentricity**2))
    return slack**2 / (pi * eccentricity * root) / slenderness**2


def short_bearing_eccentricity(sommerfeld: float, slenderness: float) -> float:
    r"""Eccentricity ratio [-] of a short bearing: :func:`short_bearing_sommerfeld` solved for \varepsilon.

    .. math:: \varepsilon: \quad S(\varepsilon, L/D) = S

    S = `sommerfeld` [-] > 0, L/D = `slenderness` [-]; S falls from infinity at \varepsilon = 0 to 0 at 1, so the
    answer is unique. Not for bearings longer than half their diameter. Source: as there.
    """
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if short_bearing_sommerfeld(middle, slenderness) > sommerfeld:
            low = middle
        else:
            high = middle
    return (low + high) / 2
