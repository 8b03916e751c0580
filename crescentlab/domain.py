"""Domains are power pairs; ports belong to a domain and have a role.

On a net exactly one port *gives* the across variables (a volume gives p); all others *take* them
and give back the through variable (an orifice gives q), positive **into** the component; the
giver receives minus their sum. A port that *reads* looks at the across variables and gives nothing.
A chamber net joins exactly two ports and its pressure returns unchanged. Signals have no through.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from crescentlab import units
from crescentlab.maths import where
from crescentlab.units import Quantity

Role = Literal["gives", "takes", "reads", "undecided"]
Entry = Literal["", "content", "energy", "dissipation", "supply"]
"""What an observable enters in a ledger: fluid stored, energy stored, power turned into heat, power from outside."""


@dataclass(frozen=True)
class Domain:
    """A pair of across and through variables, each a name and a quantity."""

    name: str
    across: tuple[tuple[str, Quantity], ...]
    through: tuple[tuple[str, Quantity], ...]
    giver: str
    """What to insert where nothing gives the across variable."""


HYDRAULIC = Domain(
    "hydraulic",
    (("p", units.pressure),),
    (("q", units.flow),),
    "a capacity, for example {type: capacity, volume: 10 cm^3}, its port on this net",
)
TRANSLATIONAL = Domain(
    "translational", (("x", units.length), ("v", units.velocity)), (("f", units.force),),
    "a mass, for example {type: mass, mass: 20 g}, its port on this net",
)  # fmt: skip
ROTATIONAL = Domain(
    "rotational", (("phi", units.angle), ("omega", units.speed)), (("torque", units.torque),),
    "a shaft speed, for example {type: speed_source, speed: 2000 rpm}, its shaft on this net",
)  # fmt: skip
CHAMBER = Domain(
    "chamber", (("V", units.volume), ("dV", units.flow)), (("p", units.pressure),), "a part that shapes a volume"
)
SIGNAL = Domain("signal", (("", units.ratio),), (), "a source of the signal")

ENERGY_ENTRIES: tuple[Entry, ...] = ("energy", "dissipation", "supply")
"""The entries of the ledger of energy."""

Size = int | str | Callable[[Any], int]
"""A number of elements: fixed, the name of an int field or property, or a function of the component."""


class Declared:
    """Something a component class declares under a name of its own."""

    name: str = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name


@dataclass(eq=False)
class Port(Declared):
    """A place where a component meets a net; ``size`` makes it a vector."""

    domain: Domain
    role: Role
    description: str
    size: Size | None = None
    quantity: Quantity | str | None = None
    """Signals only: the quantity carried, or the name of the field that names it."""
    low: float | None = None
    """Signals taken only: the least value that has a meaning; less is counted as this."""
    high: float | None = None
    """Signals taken only: the largest value that has a meaning; more is counted as this."""

    @property
    def ranged(self) -> bool:
        """Whether the signal that it takes is held within a range."""
        return self.low is not None or self.high is not None

    def within(self, signal: Any) -> Any:
        """The signal held within the range; at its ends it still has its own slope."""
        if self.low is not None:
            signal = where(signal < self.low, self.low, signal)
        return signal if self.high is None else where(signal > self.high, self.high, signal)

    def variables(self, kind: Literal["across", "through"]) -> list[tuple[str, Quantity | str]]:
        """Names (as equations use them) and quantities of the port's variables of one kind."""
        if self.domain is SIGNAL:
            return [(self.name, self.quantity or units.ratio)] if kind == "across" else []
        pairs = self.domain.across if kind == "across" else self.domain.through
        return [(f"{variable}_{self.name}", quantity) for variable, quantity in pairs]

    def inputs(self) -> list[tuple[str, Quantity | str]]:
        """Variables the component may ask for at this port."""
        return self.variables("through" if self.role == "gives" else "across")

    def outputs(self) -> list[tuple[str, Quantity | str]]:
        """Variables the component must return for this port."""
        if self.role == "reads":
            return []
        return self.variables("across" if self.role == "gives" else "through")


def gives_pressure(description: str, *, size: Size | None = None) -> Any:
    """Hydraulic port that gives p [Pa, gauge] and receives q [m^3/s], positive into the component."""
    return Port(HYDRAULIC, "gives", description, size)


def takes_pressure(description: str, *, size: Size | None = None) -> Any:
    """Hydraulic port that takes p and gives q, positive into the component."""
    return Port(HYDRAULIC, "takes", description, size)


def reads_pressure(description: str, *, size: Size | None = None) -> Any:
    """Hydraulic port that reads p and passes no flow."""
    return Port(HYDRAULIC, "reads", description, size)


def undecided_pressure(description: str, *, size: Size | None = None) -> Any:
    """Hydraulic port of a family: its forms say whether it gives or takes the pressure."""
    return Port(HYDRAULIC, "undecided", description, size)


def gives_motion(description: str, *, size: Size | None = None) -> Any:
    """Translational port that gives x [m], v [m/s] and receives f [N], positive on the component."""
    return Port(TRANSLATIONAL, "gives", description, size)


def takes_motion(description: str, *, size: Size | None = None) -> Any:
    """Translational port that takes x, v and gives f, positive on the component."""
    return Port(TRANSLATIONAL, "takes", description, size)


def reads_motion(description: str, *, size: Size | None = None) -> Any:
    """Translational port that reads x, v and gives no force."""
    return Port(TRANSLATIONAL, "reads", description, size)


def gives_rotation(description: str, *, size: Size | None = None) -> Any:
    """Rotational port that gives phi [rad], omega [rad/s] and receives torque [N m] on the component."""
    return Port(ROTATIONAL, "gives", description, size)


def takes_rotation(description: str, *, size: Size | None = None) -> Any:
    """Rotational port that takes phi, omega and gives the torque on the component."""
    return Port(ROTATIONAL, "takes", description, size)


def reads_rotation(description: str, *, size: Size | None = None) -> Any:
    """Rotational port that reads phi, omega and gives no torque."""
    return Port(ROTATIONAL, "reads", description, size)


def gives_chamber(description: str, *, size: Size | None = None) -> Any:
    """Port that shapes a volume: gives V [m^3] > 0 and dV/dt [m^3/s], is answered by p [Pa]."""
    return Port(CHAMBER, "gives", description, size)


def takes_chamber(description: str, *, size: Size | None = None) -> Any:
    """Port of the capacity that is shaped: takes V and dV/dt, answers with its p."""
    return Port(CHAMBER, "takes", description, size)


def gives_signal(quantity: Any, description: str, *, size: Size | None = None) -> Any:
    """Signal output; ``quantity`` is a field type, or the name of a field that names a quantity."""
    return Port(
        SIGNAL, "gives", description, size, quantity if isinstance(quantity, str) else units.quantity_of(quantity)
    )


def takes_signal(
    quantity: Any, description: str, *, size: Size | None = None, low: float | None = None, high: float | None = None
) -> Any:
    """Signal input; ``quantity`` is a field type, or the name of a field that names a quantity.

    ``low`` and ``high``, in SI, are its range: equations never see a value beyond it, and a run in which the signal
    went there warns.
    """
    carried = quantity if isinstance(quantity, str) else units.quantity_of(quantity)
    return Port(SIGNAL, "takes", description, size, carried, low, high)


@dataclass(eq=False)
class State(Declared):
    """A continuous state: ``der_<name>`` must be returned."""

    quantity: Quantity | str
    description: str
    start: float | str | Callable[[Any], Any] = 0.0
    nominal: float | None = None
    size: Size | None = None
    counts: bool = False


@dataclass(eq=False)
class Held(Declared):
    """A value that changes only at events."""

    quantity: Quantity | str
    description: str
    start: float | str | Callable[[Any], Any] = 0.0
    size: Size | None = None
    counts: bool = False


@dataclass(eq=False)
class Scheduled(Held):
    """A held vector that follows a schedule, by the method ``by`` of its component: (start, stop) -> Schedule."""

    by: str = ""


@dataclass(eq=False)
class Observable(Declared):
    """A returned value that a result can show; ``entry`` says what it enters in the ledgers of fluid and energy."""

    quantity: Quantity | str
    description: str
    size: Size | None = None
    entry: Entry = ""

    @property
    def deduced(self) -> bool:
        """Whether equations may leave it out: it is then the power through the component's ports."""
        return self.entry in ("dissipation", "supply")


def _named(quantity: Any) -> Quantity | str:
    return quantity if isinstance(quantity, str) else units.quantity_of(quantity)


def state(
    quantity: Any, description: str, *, start: float | str | Callable[[Any], Any] = 0.0, nominal: float | None = None,
    size: Size | None = None, counts: bool = False,
) -> Any:  # fmt: skip
    """A continuous state. ``start`` is SI, a field's name or a function; ``nominal`` sets its tolerance.

    A state that ``counts`` goes on for ever, as a turning angle does, and only its differences matter: a steady or
    periodic run does not wait for it to rest.
    """
    return State(_named(quantity), description, start, nominal, size, counts)


def held(
    quantity: Any, description: str, *, start: float | str | Callable[[Any], Any] = 0.0, size: Size | None = None,
    counts: bool = False,
) -> Any:  # fmt: skip
    """A held value, changed only by ``when`` and ``every``; for ``counts`` see :func:`state`."""
    return Held(_named(quantity), description, start, size, counts)


def scheduled(description: str, *, by: str, size: Size) -> Any:
    """A held vector that takes the rows of a :class:`crescentlab.schedule.Schedule`, each at its instant.

    ``by`` names the component's method (start, stop) -> Schedule, which covers a run between these times [s]. The rows
    are plain numbers: what they are made from must be structural.
    """
    return Scheduled(units.ratio, description, 0.0, size, counts=False, by=by)


def observable(quantity: Any, description: str, *, size: Size | None = None) -> Any:
    """A value worth showing that is neither a port variable nor a state."""
    return Observable(_named(quantity), description, size)


def stores(description: str = "fluid content, as volume at 0 bar gauge") -> Any:
    """The observable [m^3] whose rate equals the sum of the component's hydraulic flows (its balance)."""
    return Observable(units.volume, description, None, "content")


def stores_energy(description: str = "stored energy") -> Any:
    """The observable [J], a function of states and held values, whose rate the ledger of energy expects.

    Its rate, with what :func:`dissipates` says [W], equals the power that enters through the ports: p q at hydraulic
    ports (strictly :math:`\\rho_0 q w(p)`, see ``Fluid.enthalpy``), f v, torque omega, and p dV/dt of chambers. Fluid
    of volume V holds V times ``fluid.energy_density(p)``.
    """
    return Observable(units.energy, description, None, "energy")


def dissipates(description: str = "power turned into heat") -> Any:
    """The observable [W] of what leaves the circuit as heat. A part that loses nothing returns 0.

    A part that stores no energy may leave it out of what it returns: all that enters through its ports is then lost.
    """
    return Observable(units.power, description, None, "dissipation")


def supplies(description: str = "power from outside the circuit") -> Any:
    """The observable [W] of a source or a boundary, negative where power leaves there.

    A part that stores no energy may leave it out: it then supplies all that leaves through its ports.
    """
    return Observable(units.power, description, None, "supply")
