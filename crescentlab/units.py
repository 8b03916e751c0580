"""Quantities, and the closed list of units as engineers write them.

A number with a dimension enters as text with a unit (``30 L/min``) and is a plain SI float
inside. Each quantity accepts only its own units, so a speed reads ``1/min`` as revolutions and
refuses ``Hz``, and ``5 Nm`` is a torque and nothing else. Field types such as :data:`Pressure`
are annotated floats: pydantic parses text through them and takes floats as SI.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from crescentlab.errors import ComponentError, UnitError, nearest

Dims = tuple[int, int, int, int]
"""Exponents of kg, m, s, K. Angles are pure numbers."""

NO_DIMS: Dims = (0, 0, 0, 0)

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*\Z", re.DOTALL)


@dataclass(frozen=True)
class Quantity:
    """A kind of number: its SI unit, dimensions, accepted units and usual size.

    ``units`` maps a normalised unit to its factor to SI; ``offset`` units (degC) are listed in
    ``offsets``. ``nominal`` is the magnitude from which a state's absolute tolerance is made.
    """

    name: str
    si: str
    dims: Dims
    units: Mapping[str, float] = field(hash=False, compare=False, repr=False)
    nominal: float = 1.0
    offsets: Mapping[str, float] = field(default_factory=dict, hash=False, compare=False, repr=False)

    def parse(self, text: str) -> float:
        """Return ``text`` (number and unit) in SI; raise :class:`UnitError` saying what to write."""
        number, unit = _split(text, f"; write for example {self.example()}")
        value = number * self.factor(unit, text) + self.offsets.get(normalise(unit), 0.0)
        if not math.isfinite(value):
            raise UnitError(f"{text!r} is not a finite number")
        return value

    def factor(self, unit: str, text: str = "") -> float:
        """Return the factor of ``unit`` to SI; raise :class:`UnitError` if it is not this quantity's."""
        key = normalise(unit)
        if key in self.units:
            return self.units[key]
        said = f"{text!r}: " if text else ""
        if not key:
            match = _NUMBER.match(text)
            asked = f": {self._readings(float(match[1]))}?" if match else f"; write one of {self.choices()}"
            raise UnitError(f"{said}{self.titled} needs a unit{asked}")
        near = nearest_unit(key, self.units)
        advice = f": {near} Write one of {self.choices()}" if near else f"; write one of {self.choices()}"
        others = [q.title for q in QUANTITIES.values() if key in q.units and q is not pressure_difference]
        if others:
            raise UnitError(f"{said}{unit!r} is a unit of {' and '.join(others[:3])}, not of {self.title}{advice}")
        raise UnitError(f"{said}unknown unit {unit!r} for {self.titled}{advice}")

    def _readings(self, value: float) -> str:
        """An SI number in the SI unit and in usual ones, the largest first: ``0.001 m3, 1 L or 1000 cm3``."""
        usual: dict[tuple[float, float], str] = {}
        for unit in [normalise(self.si), *self.units]:
            if unit and unit in self.units:
                usual.setdefault((self.units[unit], self.offsets.get(unit, 0.0)), unit)
        shown = sorted(list(usual.items())[:3], reverse=True)
        texts = [self.show(value, unit, 6) for _, unit in shown]
        return " or ".join([text for text in (", ".join(texts[:-1]), texts[-1]) if text])

    def check_difference(self, text: str) -> None:
        """Refuse a difference in a unit that counts from a zero of its own."""
        match = _NUMBER.match(text)
        unit = normalise(match[2]) if match else ""
        if match and self.offsets.get(unit):
            plain = [u for u in (self.si, *self.units) if not self.offsets.get(u)]
            same = next((u for u in plain if self.units.get(u) == self.units[unit]), self.si)
            number = float(match[1]) * self.units[unit] / self.units[normalise(same)]
            raise UnitError(f"{text!r}: this is a difference of two {self.title}s; write {number:g} {same}")

    @property
    def title(self) -> str:
        """The quantity's name in words."""
        return self.name.replace("_", " ")

    @property
    def titled(self) -> str:
        """The quantity's name in words with its article."""
        return f"{'an' if self.name[0] in 'aeio' else 'a'} {self.title}"

    def choices(self) -> str:
        """The first accepted units, for messages."""
        return ", ".join([u for u in self.units if u][:8]) or "no unit"

    def example(self, text: str = "") -> str:
        """A valid way to write a number of this quantity, reusing the number of ``text``."""
        match = _NUMBER.match(text)
        return f"{match[1] if match else '1'} {next(iter(self.units))}".strip()

    def show(self, value: float, unit: str | None = None, digits: int = 5) -> str:
        """``value`` (SI) as text in ``unit``, by default the SI unit."""
        shown = self.si if unit is None else unit
        scaled = (value - self.offsets.get(normalise(shown), 0.0)) / self.units.get(normalise(shown), 1.0)
        return f"{scaled:.{digits}g} {shown}".rstrip()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic read text with a unit, or an SI float."""
        return core_schema.no_info_before_validator_function(self._validate, handler(source))

    def _validate(self, value: Any) -> Any:
        if isinstance(value, str):
            try:
                return self.parse(value)
            except UnitError as error:
                raise PydanticCustomError("unit", "{reason}", {"reason": error.message}) from None
        return value


def _split(text: str, advice: str = "") -> tuple[float, str]:
    """The number and the unit of a text; raise :class:`UnitError` if it does not begin with a number."""
    match = _NUMBER.match(text)
    if not match:
        raise UnitError(
            f"{repr(text) + ' is not a number with a unit' if text.strip() else 'the value is missing'}{advice}"
        )
    if re.match(r",\d", match[2]):
        raise UnitError(f"{text!r}: decimals follow a point; write {text.replace(',', '.', 1)}")
    return float(match[1]), match[2]


def nearest_unit(unit: str, known: Iterable[str]) -> str:
    """The question that offers units like this one, the same letters in another case first; empty if there are none."""
    units = [u for u in known if u]
    same = [u for u in units if u.lower() == unit.lower()]
    return f"did you mean {' or '.join(same)}?" if same else nearest(unit, units, otherwise=" ").strip()


def normalise(unit: str) -> str:
    """Fold the ways of writing one unit into one: ``mm^2``, ``mm²`` and ``mm2`` are ``mm2``."""
    text = unit.strip()
    for old, new in (("²", "2"), ("³", "3"), ("**", ""), ("^", ""), ("µ", "u"), ("μ", "u"), ("·", " "), ("*", " ")):
        text = text.replace(old, new)
    text = re.sub(r"\s*/\s*", "/", text)
    return re.sub(r"\s+", " ", text)


_RPM = 2.0 * math.pi / 60.0
_PSI = 6894.757293168361
_BAR = 1e5
_LPM = 1e-3 / 60.0
_GALLON = 231 * 0.0254**3
_INCH, _FOOT = 0.0254, 0.3048
_POUND, _POUND_FORCE = 0.45359237, 4.4482216152605
_SLUG = _POUND_FORCE / _FOOT
ATMOSPHERE = 101325.0
"""The standard atmosphere [Pa]: pressures are gauge, so an absolute one is less by this."""

_PER_TIME = {"1/s": 1.0, "1/min": 1.0 / 60.0}

QUANTITIES: dict[str, Quantity] = {}


def _quantity(name: str, si: str, dims: Dims, nominal: float, units: Mapping[str, float], **offsets: float) -> Quantity:
    made = Quantity(name, si, dims, dict(units), nominal, offsets)
    QUANTITIES[name] = made
    return made


_PRESSURE_UNITS = {
    "bar": _BAR, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mbar": 100.0, "hPa": 100.0,
    "psi": _PSI, "N/mm2": 1e6, "N/m2": 1.0, "atm": ATMOSPHERE, "kgf/cm2": 98066.5, "mH2O": 9806.65,
}  # fmt: skip
_GAUGE_UNITS = {"barg": _BAR, "psig": _PSI}
_ABSOLUTE_UNITS = {"bara": _BAR, "psia": _PSI}
_LENGTH_UNITS = {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "nm": 1e-9, "in": _INCH, "ft": _FOOT}
_AREA_UNITS = {"mm2": 1e-6, "m2": 1.0, "cm2": 1e-4, "in2": _INCH**2, "ft2": _FOOT**2}
_VOLUME_UNITS = {
    "cm3": 1e-6, "m3": 1.0, "L": 1e-3, "l": 1e-3, "mL": 1e-6, "ml": 1e-6, "cc": 1e-6, "mm3": 1e-9, "dm3": 1e-3,
    "in3": _INCH**3, "gal": _GALLON, "ft3": _FOOT**3,
}  # fmt: skip
_TIME_UNITS = {"ms": 1e-3, "s": 1.0, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
_ANGLE_UNITS = {"deg": math.pi / 180.0, "rad": 1.0, "°": math.pi / 180.0, "mrad": 1e-3, "rev": 2 * math.pi}
_FORCE_UNITS = {"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "lbf": _POUND_FORCE}
_TORQUE_UNITS = {
    "Nm": 1.0, "N m": 1.0, "kNm": 1e3, "kN m": 1e3, "Nmm": 1e-3, "N mm": 1e-3, "mNm": 1e-3,
    "lbf ft": _POUND_FORCE * _FOOT, "lbf in": _POUND_FORCE * _INCH, "ft lbf": _POUND_FORCE * _FOOT,
    "in lbf": _POUND_FORCE * _INCH,
}  # fmt: skip
_FLOW_UNITS = {
    "L/min": _LPM, "l/min": _LPM, "l/mn": _LPM, "L/mn": _LPM, "lpm": _LPM, "LPM": _LPM, "m3/s": 1.0, "L/s": 1e-3,
    "l/s": 1e-3, "cm3/s": 1e-6, "cc/s": 1e-6, "mL/s": 1e-6, "mm3/s": 1e-9, "m3/h": 1 / 3600.0, "m3/min": 1 / 60.0,
    "L/h": 1e-3 / 3600.0, "l/h": 1e-3 / 3600.0, "mL/min": 1e-6 / 60.0, "ml/min": 1e-6 / 60.0, "cm3/min": 1e-6 / 60.0,
    "cc/min": 1e-6 / 60.0, "gal/min": _GALLON / 60.0, "gpm": _GALLON / 60.0, "GPM": _GALLON / 60.0,
    "in3/s": _INCH**3, "in3/min": _INCH**3 / 60.0, "ft3/s": _FOOT**3, "ft3/min": _FOOT**3 / 60.0,
}  # fmt: skip
_PER_REV = 1.0 / (2.0 * math.pi)
_DISPLACEMENT_UNITS = {
    "cc/rev": 1e-6 * _PER_REV, "cm3/rev": 1e-6 * _PER_REV, "m3/rad": 1.0, "mL/rev": 1e-6 * _PER_REV,
    "L/rev": 1e-3 * _PER_REV, "cm3/rad": 1e-6, "cc/rad": 1e-6, "mm3/rad": 1e-9, "mm3/rev": 1e-9 * _PER_REV,
    "m3/rev": _PER_REV, "mm3/deg": 1e-9 * 180.0 / math.pi, "in3/rev": _INCH**3 * _PER_REV,
    "in3/rad": _INCH**3,
}  # fmt: skip

ratio = _quantity("ratio", "1", NO_DIMS, 1.0, {"": 1.0, "1": 1.0, "%": 1e-2, "-": 1.0, "ppm": 1e-6})
pressure = _quantity(
    "pressure", "Pa", (1, -1, -2, 0), _BAR, {**_PRESSURE_UNITS, **_GAUGE_UNITS, **_ABSOLUTE_UNITS},
    **dict.fromkeys(_ABSOLUTE_UNITS, -ATMOSPHERE),
)  # fmt: skip
pressure_difference = _quantity("pressure_difference", "Pa", (1, -1, -2, 0), _BAR, _PRESSURE_UNITS)
flow = _quantity("flow", "m^3/s", (0, 3, -1, 0), _LPM, _FLOW_UNITS)
volume = _quantity("volume", "m^3", (0, 3, 0, 0), 1e-6, _VOLUME_UNITS)
displacement = _quantity("displacement", "m^3/rad", (0, 3, 0, 0), 1e-6, _DISPLACEMENT_UNITS)
length = _quantity("length", "m", (0, 1, 0, 0), 1e-3, _LENGTH_UNITS)
area = _quantity("area", "m^2", (0, 2, 0, 0), 1e-6, _AREA_UNITS)
time = _quantity("time", "s", (0, 0, 1, 0), 1.0, _TIME_UNITS)
frequency = _quantity(
    "frequency", "Hz", (0, 0, -1, 0), 1.0, {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, **_PER_TIME}
)
angle = _quantity("angle", "rad", NO_DIMS, 1.0, _ANGLE_UNITS)
speed = _quantity(
    "speed", "rad/s", (0, 0, -1, 0), 1.0,
    {"rpm": _RPM, "rad/s": 1.0, "1/min": _RPM, "r/min": _RPM, "rev/min": _RPM, "rev/s": 2 * math.pi,
     "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0},
)  # fmt: skip
velocity = _quantity(
    "velocity", "m/s", (0, 1, -1, 0), 1e-2,
    {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "um/s": 1e-6, "m/min": 1 / 60.0, "mm/min": 1e-3 / 60.0, "km/h": 1 / 3.6,
     "in/s": _INCH, "ft/s": _FOOT, "in/min": _INCH / 60.0, "ft/min": _FOOT / 60.0},
)  # fmt: skip
acceleration = _quantity("acceleration", "m/s^2", (0, 1, -2, 0), 1.0, {"m/s2": 1.0, "mm/s2": 1e-3, "ft/s2": _FOOT})
mass = _quantity(
    "mass", "kg", (1, 0, 0, 0), 1.0, {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "t": 1e3, "lb": _POUND, "slug": _SLUG}
)
inertia = _quantity(
    "inertia", "kg m^2", (1, 2, 0, 0), 1e-3,
    {"kg m2": 1.0, "kg cm2": 1e-4, "g mm2": 1e-9, "kg mm2": 1e-6, "lb ft2": _POUND * _FOOT**2,
     "lb in2": _POUND * _INCH**2, "slug ft2": _SLUG * _FOOT**2},
)  # fmt: skip
force = _quantity("force", "N", (1, 1, -2, 0), 1.0, _FORCE_UNITS)
torque = _quantity("torque", "N m", (1, 2, -2, 0), 1.0, _TORQUE_UNITS)
energy = _quantity(
    "energy", "J", (1, 2, -2, 0), 1.0, {"J": 1.0, "kJ": 1e3, "MJ": 1e6, "mJ": 1e-3, "Wh": 3600.0, "kWh": 3.6e6}
)
power = _quantity(
    "power", "W", (1, 2, -3, 0), 1.0, {"W": 1.0, "kW": 1e3, "MW": 1e6, "mW": 1e-3, "hp": 745.6998715822702}
)
density = _quantity(
    "density",
    "kg/m^3",
    (1, -3, 0, 0),
    1e3,
    {"kg/m3": 1.0, "g/cm3": 1e3, "kg/L": 1e3, "kg/l": 1e3, "kg/dm3": 1e3, "lb/ft3": _POUND / _FOOT**3},
)
kinematic_viscosity = _quantity(
    "kinematic_viscosity", "m^2/s", (0, 2, -1, 0), 1e-6, {"cSt": 1e-6, "m2/s": 1.0, "mm2/s": 1e-6, "St": 1e-4}
)
dynamic_viscosity = _quantity(
    "dynamic_viscosity", "Pa s", (1, -1, -1, 0), 1e-3, {"mPa s": 1e-3, "Pa s": 1.0, "cP": 1e-3, "P": 0.1, "N s/m2": 1.0}
)
temperature = _quantity(
    "temperature",
    "K",
    (0, 0, 0, 1),
    1.0,
    {"degC": 1.0, "K": 1.0, "°C": 1.0, "degF": 5 / 9, "°F": 5 / 9},
    **{"degC": 273.15, "°C": 273.15, "degF": 459.67 * 5 / 9, "°F": 459.67 * 5 / 9},
)
stiffness = _quantity(
    "stiffness",
    "N/m",
    (1, 0, -2, 0),
    1e3,
    {"N/mm": 1e3, "N/m": 1.0, "kN/m": 1e3, "N/um": 1e6, "kN/mm": 1e6, "lbf/in": _POUND_FORCE / _INCH},
)
damping = _quantity(
    "damping", "N s/m", (1, 0, -1, 0), 1.0,
    {"N s/m": 1.0, "Ns/m": 1.0, "N/(m/s)": 1.0, "N s/mm": 1e3, "kN s/m": 1e3, "N/(mm/s)": 1e3, "kg/s": 1.0},
)  # fmt: skip
rotary_stiffness = _quantity(
    "rotary_stiffness", "N m/rad", (1, 2, -2, 0), 1.0, {"N m/rad": 1.0, "Nm/rad": 1.0, "Nm/deg": 180 / math.pi}
)
rotary_damping = _quantity(
    "rotary_damping", "N m s/rad", (1, 2, -1, 0), 1.0,
    {"N m s/rad": 1.0, "Nms/rad": 1.0, "N m s": 1.0, "Nm s": 1.0, "Nm/(rad/s)": 1.0, "Nm/rpm": 1 / _RPM},
)  # fmt: skip
flow_resistance = _quantity(
    "flow_resistance", "Pa s/m^3", (1, -4, -1, 0), _BAR / _LPM,
    {"bar/(L/min)": _BAR / _LPM, "Pa s/m3": 1.0, "bar/(l/min)": _BAR / _LPM, "Pa/(m3/s)": 1.0,
     "bar min/L": _BAR / _LPM},
)  # fmt: skip
quadratic_resistance = _quantity(
    "quadratic_resistance", "Pa s^2/m^6", (1, -7, 0, 0), _BAR / _LPM**2,
    {"bar/(L/min)2": _BAR / _LPM**2, "Pa s2/m6": 1.0, "bar/(l/min)2": _BAR / _LPM**2, "Pa/(m3/s)2": 1.0},
)  # fmt: skip
flow_conductance = _quantity(
    "flow_conductance", "m^3/(s Pa)", (-1, 4, 1, 0), _LPM / _BAR,
    {"L/min/bar": _LPM / _BAR, "(L/min)/bar": _LPM / _BAR, "m3/(s Pa)": 1.0, "m3/s/Pa": 1.0},
)  # fmt: skip
pressure_rate = _quantity("pressure_rate", "Pa/s", (1, -1, -3, 0), _BAR, {"bar/s": _BAR, "Pa/s": 1.0, "bar/ms": 1e8})
temperature_rate = _quantity("temperature_rate", "K/s", (0, 0, -1, 1), 1.0, {"K/s": 1.0, "K/min": 1 / 60.0})
pressure_coefficient = _quantity(
    "pressure_coefficient", "1/Pa", (-1, 1, 2, 0), 1e-9,
    {"1/GPa": 1e-9, "1/Pa": 1.0, "1/MPa": 1e-6, "1/bar": 1e-5, "mm2/N": 1e-6, "m2/N": 1.0},
)  # fmt: skip
flow_rate_of_change = _quantity("flow_rate_of_change", "m^3/s^2", (0, 3, -2, 0), _LPM, {"L/min/s": _LPM, "m3/s2": 1.0})

Ratio = Annotated[float, ratio]
Pressure = Annotated[float, pressure]
PressureDifference = Annotated[float, pressure_difference]
"""A pressure less another: may lie below absolute zero."""
Flow = Annotated[float, flow]
Volume = Annotated[float, volume]
Displacement = Annotated[float, displacement]
Length = Annotated[float, length]
Area = Annotated[float, area]
Time = Annotated[float, time]
Frequency = Annotated[float, frequency]
Angle = Annotated[float, angle]
Speed = Annotated[float, speed]
Velocity = Annotated[float, velocity]
Acceleration = Annotated[float, acceleration]
Mass = Annotated[float, mass]
Inertia = Annotated[float, inertia]
Force = Annotated[float, force]
Torque = Annotated[float, torque]
Energy = Annotated[float, energy]
Power = Annotated[float, power]
Density = Annotated[float, density]
KinematicViscosity = Annotated[float, kinematic_viscosity]
DynamicViscosity = Annotated[float, dynamic_viscosity]
Temperature = Annotated[float, temperature]
Stiffness = Annotated[float, stiffness]
Damping = Annotated[float, damping]
RotaryStiffness = Annotated[float, rotary_stiffness]
RotaryDamping = Annotated[float, rotary_damping]
FlowResistance = Annotated[float, flow_resistance]
QuadraticResistance = Annotated[float, quadratic_resistance]
FlowConductance = Annotated[float, flow_conductance]
PressureCoefficient = Annotated[float, pressure_coefficient]
"""Relative change per pressure, for example of a viscosity."""

COMMON = "bar, L/min, mm, mm^2, cm^3, rpm, ms, deg, N, Nm, kg, cSt"
"""Units that messages name where the quantity is not known."""

DISPLAY = {
    "pressure": "bar", "flow": "L/min", "length": "mm", "speed": "rpm", "time": "ms", "angle": "deg",
}  # fmt: skip
"""Units of summaries and plots unless the circuit's ``display:`` says otherwise."""


def quantity_of(annotation: Any) -> Quantity:
    """The quantity behind a field type such as ``Pressure``, or a quantity itself."""
    if isinstance(annotation, Quantity):
        return annotation
    for extra in getattr(annotation, "__metadata__", ()):
        if isinstance(extra, Quantity):
            return extra
    raise ComponentError(f"{annotation!r} is not a quantity type; use one of crescentlab.units, for example Pressure")


def quantity_named(name: str) -> Quantity:
    """The quantity called ``name``; raises :class:`UnitError` offering the nearest."""
    if name not in QUANTITIES:
        raise UnitError(f"unknown quantity {name!r}: {nearest(name, QUANTITIES)}")
    return QUANTITIES[name]


def parse_any(text: str) -> tuple[float, Quantity]:
    """Read a number with a unit of whichever quantity owns it (the first listed, if several do)."""
    _, unit = _split(text)
    key = normalise(unit)
    owners = [q for q in QUANTITIES.values() if key in q.units]
    if not owners:
        near = nearest_unit(key, {u: 0 for q in QUANTITIES.values() for u in q.units})
        raise UnitError(f"{text!r}: unknown unit {unit!r}: {near or f'units are {COMMON} and the like'}")
    owner = speed if speed in owners else owners[0]  # 1/min is a speed, not a frequency
    return owner.parse(text), owner


def gauge_of(text: str) -> list[str]:
    """What each absolute pressure written in a text is as a gauge one: ``3 bara is 1.98675 bar``."""
    units_ = "|".join(_ABSOLUTE_UNITS)
    found = re.findall(rf"(?<![\w.])([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*({units_})\b", text)
    return [
        f"{number} {unit} is {pressure.show(pressure.parse(f'{number} {unit}'), unit.removesuffix('a'), 6)}"
        for number, unit in found
    ]


def is_number(text: str) -> bool:
    """Whether ``text`` begins as a number does."""
    return _NUMBER.match(text) is not None


def si_unit(dims: Dims) -> str:
    """The SI unit that belongs to ``dims``, preferring a named quantity's."""
    for candidate in QUANTITIES.values():
        if candidate.dims == dims:
            return candidate.si
    parts = [
        f"{base}^{power}" if power != 1 else base
        for base, power in zip(("kg", "m", "s", "K"), dims, strict=True)
        if power
    ]
    return " ".join(parts) or "1"


def quantity_with(dims: Dims) -> Quantity:
    """The first quantity of ``dims``, or a nameless one made for it."""
    for candidate in QUANTITIES.values():
        if candidate.dims == dims:
            return candidate
    unit = si_unit(dims)
    return Quantity(unit, unit, dims, {normalise(unit): 1.0})


def quantity_of_si(si: str) -> Quantity:
    """The quantity that a file's SI unit belongs to; one with a display unit before others."""
    known = [q for q in QUANTITIES.values() if q.si == si]
    shown = [q for q in known if q.name in DISPLAY]
    return (shown or known or [ratio if si in ("", "1") else Quantity(si, si, (0, 0, 0, 0), {})])[0]
