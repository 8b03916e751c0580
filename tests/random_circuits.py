"""Random circuits of valid causality, made of any parts of the library from what they declare.

A circuit is grown part by part. Each port of a part is joined to a net of its domain: a port that takes or reads looks
for a net whose pressure, motion or speed is given already, or for a new one that a volume, a mass or a rotor gives; a
port that gives opens a net of its own; an undecided port does either. A signal input gets a source of its own, often
behind filters, samplers, switches or a sensor. Numbers are drawn from the parameters' declarations: a range for each
quantity, narrowed by the parameter's name where a part would else be of no size that occurs.

The same types and seed give the same circuit, and a part's numbers depend on its own place only, so that a circuit that
fails can be made smaller by leaving parts out.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args, get_origin

import yaml
from pydantic import ValidationError

from crescentlab import units
from crescentlab.component import Component, field_quantity
from crescentlab.domain import CHAMBER, SIGNAL, Port, State
from crescentlab.library import installed
from crescentlab.units import QUANTITIES, Quantity

LEFT_OUT = {
    "crescent_gears": "shapes its volumes only together with chains and a trapped volume; test_crescent_pump has them",
    "carry_over_chain": "shifts its volumes by the phase of gears of its own pitch; test_carry_over has it",
    "trapped_volume": "exists while gears say so; test_crescent_pump has it",
    "external_gears": "needs the geometry of its teeth and chains to fit; test_external_gears has it",
    "recorded_signal": "reads a data file",
}  # fmt: skip
"""Types that are not drawn, and why."""

BARREL = ("swash_plate_barrel", "variable_swash_plate_barrel", "piston_chambers", "valve_plate")
"""Parts of one axial piston machine, drawn together: their ports are vectors of equal size."""

RANGES: dict[str, tuple[float, float]] = {
    "pressure": (5e5, 60e5), "pressure_difference": (1e5, 20e5), "flow": (2 / 6e4, 30 / 6e4), "volume": (3e-5, 3e-4),
    "displacement": (0.5e-6, 4e-6), "length": (4e-3, 15e-3), "area": (2e-6, 30e-6), "time": (1e-3, 20e-3),
    "frequency": (20.0, 200.0), "angle": (0.1, 1.2), "speed": (50.0, 200.0), "velocity": (0.02, 0.2),
    "mass": (0.5, 10.0), "inertia": (1e-3, 2e-2), "force": (50.0, 800.0), "torque": (0.5, 10.0), "energy": (1.0, 100.0),
    "power": (50.0, 2000.0), "density": (840.0, 890.0), "kinematic_viscosity": (10e-6, 60e-6),
    "stiffness": (5e3, 60e3), "damping": (50.0, 1500.0), "rotary_stiffness": (50.0, 2000.0),
    "rotary_damping": (0.01, 0.3), "flow_resistance": (6e8, 2e10), "quadratic_resistance": (1e11, 2e13),
    "flow_conductance": (1e-11, 1e-10), "acceleration": (9.0, 10.0), "ratio": (0.2, 1.0),
}  # fmt: skip
"""What a number of a quantity is drawn from, SI."""

NAMED: dict[str, tuple[float, float]] = {
    "piston_diameter": (20e-3, 50e-3), "rod_diameter": (3e-3, 4e-3), "cap_rod_diameter": (3e-3, 4e-3),
    "stroke": (0.1, 0.3), "dead_volume": (1e-5, 5e-5), "clearance": (10e-6, 40e-6), "height": (20e-6, 60e-6),
    "opening_range": (2e5, 20e5), "closing_range": (2e5, 20e5), "cracking_pressure": (1e5, 30e5),
    "centring_range": (2e5, 10e5), "control_range": (2e5, 10e5), "control_pressure": (3e5, 15e5),
    "dead_band": (0.0, 2e5), "start_level": (0.1, 0.3), "sample_time": (0.2e-3, 2e-3), "delay": (0.2e-3, 2e-3),
    "width": (5e-3, 20e-3), "high": (20e-3, 0.1), "low": (0.0, 0.0), "radius": (10e-3, 40e-3),
    "rod_length": (0.1, 0.2), "eccentricity": (1e-3, 5e-3), "narrow_diameter": (4e-3, 9e-3),
    "wide_diameter": (10e-3, 20e-3), "inner_diameter": (10e-3, 20e-3), "outer_diameter": (25e-3, 40e-3),
    "wall_thickness": (1e-3, 3e-3), "standard_deviation": (0.01, 0.1), "arm_a": (0.05, 0.2), "arm_b": (0.05, 0.2),
    "static_friction": (300.0, 400.0), "coulomb_friction": (50.0, 250.0), "play": (0.0, 0.02), "clogging": (0.5, 1.0),
    "loss_coefficient": (0.0, 2.0), "preload": (10.0, 300.0), "rated_drop": (2e5, 20e5), "remaining_area": (1e-6, 3e-6),
    "ball_diameter": (12e-3, 16e-3), "seat_diameter": (4e-3, 8e-3), "seat_position": (0.0, 2e-3),
    "overlap": (-1e-3, 2e-3), "creep_speed": (0.5, 2.0), "ratio": (0.5, 3.0), "polytropic_index": (1.0, 1.6),
    "swash_angle": (0.1, 0.3), "largest_swash_angle": (0.1, 0.3), "pitch_radius": (30e-3, 40e-3),
    "free_length": (-5e-3, 5e-3), "gap": (-1e-3, 0.0), "mean_pressure": (20e5, 40e5), "per": (1.0, 1.0),
    "kidney_width": (6e-3, 9e-3), "kidney_angle": (0.4, 0.5), "angle": (0.2, 1.4), "switching_pressure": (0.5e5, 2e5),
    "integral_time": (5e-3, 50e-3), "time_constant": (1e-3, 10e-3), "within": (2e-3, 20e-3),
    "atmospheric_pressure": (101325.0, 101325.0), "rod_dead_volume": (1e-5, 5e-5), "cap_dead_volume": (1e-5, 5e-5),
    "outlet_height": (0.0, 0.05), "viscous_friction": (100.0, 1500.0), "max_pressure": (300e5, 400e5),
}  # fmt: skip
"""The same by the parameter's name, ..."""

OF_TYPE: dict[str, tuple[float, float]] = {
    "gas_accumulator.preload": (5e5, 25e5), "reservoir.height": (0.4, 0.6), "reservoir.area": (0.05, 0.2),
    "piston_separator.start_pressure": (15e5, 25e5), "elastic_capacity.length": (0.2, 0.6),
    "stick_slip_inertia.static_friction": (3.0, 5.0), "stick_slip_inertia.coulomb_friction": (0.5, 2.5),
    "friction_brake.static_friction": (3.0, 5.0), "friction_brake.coulomb_friction": (0.5, 2.5),
    "rotary_friction.static_friction": (3.0, 5.0), "rotary_friction.coulomb_friction": (0.5, 2.5),
    "rotary_friction.viscous_friction": (0.01, 0.1), "fan_load.rated_speed": (100.0, 200.0),
    "torsion_spring.preload": (-2.0, 2.0), "pressure_source.pressure": (0.0, 60e5), "tank.pressure": (0.0, 5e5),
    "flow_source.flow": (-10 / 6e4, 30 / 6e4), "motion_source.velocity": (-0.05, 0.05),
    "force_source.force": (-500.0, 500.0),
    "torque_source.torque": (-5.0, 5.0), "rated_orifice.rated_flow": (5 / 6e4, 40 / 6e4),
    "floating_lever.share": (0.2, 0.8),
    "compliant_capacity.wall_area": (1e-4, 1e-3), "piston_chamber.dead_volume": (5e-5, 1e-4),
    "piston_chamber.diameter": (10e-3, 30e-3), "moving_annular_gap.length": (10e-3, 40e-3),
    "leakage_land.overlap": (1e-3, 5e-3), "second_order_lag.damping_ratio": (0.2, 1.0), "gear_ratio.ratio": (0.5, 2.0),
    "transfer_function.time_unit": (1e-3, 5e-3), "bend.radius": (20e-3, 60e-3),
    "swash_plate.pitch_radius": (10e-3, 20e-3),
    "two_two_valve.overlap": (-0.2, 0.2), "three_two_valve.overlap": (-0.2, 0.2), "four_two_valve.overlap": (-0.2, 0.2),
    "four_three_valve.overlap": (-0.2, 0.2), "short_tube.length": (5e-3, 50e-3),
    "spool_drive.damping_ratio": (0.3, 1.0),
    "energy_counter.start": (0.0, 0.0), "cushion.end": (0.0, 5e-3), "elastic_contact.clearance": (0.0, 5e-3),
}  # fmt: skip
"""... and by type and name."""

LONG = ("pipe", "distributed_line", "lax_wendroff_line", "transmission_line", "pipe_resistance")
"""Their `length` is that of a line."""

SIGNALS: dict[str, tuple[float, float]] = {
    "ratio": (0.0, 1.0), "pressure": (5e5, 40e5), "flow": (-5 / 6e4, 20 / 6e4), "force": (-400.0, 400.0),
    "torque": (-4.0, 4.0), "speed": (20.0, 150.0), "length": (0.0, 2e-4), "angle": (0.0, 1.0), "power": (0.0, 500.0),
    "velocity": (-0.1, 0.1), "energy": (0.0, 10.0), "volume": (0.0, 1e-4),
}  # fmt: skip
"""The range of a signal of a quantity, SI."""

SENSORS = {
    "pressure": ("pressure_sensor", "differential_pressure_sensor"), "flow": ("flow_sensor",),
    "speed": ("speed_sensor",),
    "angle": ("angle_sensor",), "length": ("position_sensor",), "velocity": ("velocity_sensor",),
    "force": ("force_sensor",),
    "torque": ("torque_sensor",), "power": ("hydraulic_power_meter", "linear_power_meter", "shaft_power_meter"),
    "volume": ("volume_counter",),
}  # fmt: skip
LETTERS = {"hydraulic": "p", "translational": "x", "rotational": "r", "chamber": "c", "signal": "s"}
"""First letters of the nets' names."""
DEEPEST = 3
"""Parts in a row behind a signal input, its source not counted."""
STARTS = {"x": (2e-3, 20e-3), "omega": (0.0, 100.0)}
"""Where positions and speeds begin, by the state's name."""


@dataclass
class Net:
    """A net that grows: its domain, its ports, its fluid; the size of its vectors."""

    domain: str
    ports: list[str]
    fluid: str = ""
    size: int | None = None
    start: tuple[float, float] = (0.0, 0.0)


@dataclass
class Growing:
    """A circuit while it grows."""

    seed: int
    base: float
    components: dict[str, dict[str, Any]] = field(default_factory=dict)
    nets: list[Net] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    random: random.Random = field(default_factory=random.Random)

    # -- parts -------------------------------------------------------------------------------------

    def add(self, kind: str, fixed: dict[str, Any] | None = None, fluid: str = "oil") -> str:
        """A part of this type with random numbers, its ports not joined yet; its name."""
        cls = library()[kind]
        for _ in range(30):
            values = self.numbers(kind, cls) | (fixed or {})
            try:
                parsed = cls.model_validate(values)
            except ValidationError:
                continue
            break
        else:
            raise ValueError(f"no numbers for {kind}")
        k = self.counts[kind] = self.counts.get(kind, 0) + 1
        name = f"{kind}_{k}"
        starts = self.starts(cls)
        self.components[name] = {"type": kind, **values, **({"start": starts} if starts else {})}
        self.parsed[name] = parsed
        return name

    parsed: dict[str, Component] = field(default_factory=dict)

    def numbers(self, kind: str, cls: type[Component]) -> dict[str, Any]:
        """Values of parameters as text: the required ones, and some of those with a default."""
        values: dict[str, Any] = {}
        draw = self.random
        for name, declared in cls.model_fields.items():
            quantity = field_quantity(declared)
            where = OF_TYPE.get(f"{kind}.{name}") or NAMED.get(name)
            choices = get_args(declared.annotation) if get_origin(declared.annotation) is Literal else ()
            if name == "length" and kind in LONG:
                where = (0.1, 1.0)
            if name in ("start_pressure",):
                values[name] = text(units.pressure, self.base * draw.uniform(0.8, 1.2))
            elif not declared.is_required():
                default = declared.default
                if choices and draw.random() < 0.4:
                    values[name] = draw.choice(choices)
                elif declared.annotation is bool and draw.random() < 0.3:
                    values[name] = draw.choice(["true", "false"])
                elif name in ("cells", "lumps"):
                    values[name] = str(draw.randint(1, 6))
                elif name == "friction_terms" and draw.random() < 0.3:
                    values[name] = str(draw.randint(0, 4))
                elif quantity and isinstance(default, float) and draw.random() < 0.25:
                    low, high = where if where and default == 0.0 else (0.7 * default, 1.3 * default)
                    if f"{kind}.{name}" in OF_TYPE or low < high:
                        values[name] = text(quantity, draw.uniform(low, high))
            elif quantity is not None:
                values[name] = text(quantity, draw.uniform(*(where or RANGES[quantity.name])))
            elif name == "deflection":
                wide = draw.uniform(1e-5, 5e-5)
                values[name] = {
                    "x": ["0 bar", "20 bar", "80 bar"],
                    "y": ["0 mm", *(text(units.length, k * wide) for k in (1, 2))],
                }
        return values

    def starts(self, cls: type[Component]) -> dict[str, str]:
        """Start values of pressures, positions and speeds."""
        found: dict[str, str] = {}
        for state in cls.forms()[0].declared(State):
            quantity = state.quantity
            if isinstance(quantity, str) or not isinstance(state.start, float):
                continue
            if quantity is units.pressure:
                found[state.name] = text(quantity, self.base * self.random.uniform(0.7, 1.3))
            elif state.name in STARTS and cls.ports()[0].role == "gives" and len(cls.ports()) == 1:
                found[state.name] = text(quantity, self.random.uniform(*STARTS[state.name]))
        return found

    # -- nets --------------------------------------------------------------------------------------

    def given(self, domain: str, fluid: str, apart: Sequence[Net] = (), size: int | None = None) -> list[Net]:
        """Nets of a domain on which something gives the across variable."""
        return [
            n for n in self.nets
            if n.domain == domain and n.size == size and n not in apart and (domain != "hydraulic" or n.fluid == fluid)
        ]  # fmt: skip

    def open_net(self, domain: str, name: str, port: str, fluid: str, size: int | None = None) -> Net:
        """A new net that this port gives."""
        net = Net(domain, [f"{name}.{port}"], fluid if domain == "hydraulic" else "", size)
        self.nets.append(net)
        return net

    def source(self, domain: str, fluid: str) -> Net:
        """A new net and something that gives it."""
        draw = self.random
        if domain == "hydraulic":
            kind = draw.choices(
                ["capacity", "elastic_capacity", "pressure_source", "tank", "gas_accumulator"], [6, 1, 1, 1, 1]
            )[0]
            fixed = (
                {"pressure": text(units.pressure, self.base * draw.uniform(0.6, 1.2))}
                if kind in ("pressure_source", "tank")
                else {}
            )
            return self.join(self.add(kind, fixed), fluid)
        if domain == "translational":
            kind = draw.choices(
                ["mass", "mass_with_stops", "stick_slip_mass", "stick_slip_mass_with_stops"], [5, 1, 1, 1]
            )[0]
            net = self.join(self.add(kind), fluid)
            for other, share in (("spring", 0.7), ("damper", 0.7)):
                if draw.random() < share:
                    name = self.add(other)
                    net.ports.append(f"{name}.rod")
            return net
        kind = draw.choices(["inertia", "speed_source", "stick_slip_inertia", "signal_speed_source"], [5, 3, 1, 1])[0]
        return self.join(self.add(kind), fluid)

    def join(self, name: str, fluid: str, prefer_new: float = 0.15, but: str = "") -> Net:
        """Join every port of a part ``but`` one; the first net that it gives, else the first it takes."""
        part, draw = self.parsed[name], self.random
        cls = type(part)
        mine: list[Net] = []
        given: list[Net] = []
        fluids = (
            {"a": fluid, "b": "other" if draw.random() < 0.5 else fluid}
            if cls.type_name() == "piston_separator"
            else {}
        )
        forms = cls.ports()
        for port in forms:
            size = size_of(part, port)
            if port.name == but or size == 0:
                continue
            if port.domain is SIGNAL:
                self.join_signal(name, part, port, size)
                continue
            domain, here = port.domain.name, fluids.get(port.name, fluid)
            role = port.role
            if role == "undecided":
                role = "gives" if draw.random() < 0.15 else "takes"
            if port.domain is CHAMBER:
                self.join_chamber(name, part, port, here, size)
            elif role == "gives":
                net = self.open_net(domain, name, port.name, here, size)
                given.append(net)
                mine.append(net)
            else:
                known = self.given(domain, here, mine)
                net = draw.choice(known) if known and draw.random() > prefer_new else self.source(domain, here)
                net.ports.append(f"{name}.{port.name}")
                mine.append(net)
        return (given or mine or [Net("none", [])])[0]

    def join_chamber(self, name: str, part: Component, port: Port, fluid: str, size: int | None) -> None:
        """A chamber joins the part that shapes it and the part that fills it."""
        if size is not None:
            return  # parts of an axial piston machine are joined together
        if any(f"{name}.{port.name}" in n.ports for n in self.nets):
            return
        net = Net("chamber", [f"{name}.{port.name}"])
        self.nets.append(net)
        if port.role == "gives":
            other = self.add(self.random.choice(["variable_capacity", "compliant_capacity"]))
            net.ports.append(f"{other}.chamber")
            self.join(other, fluid)
        else:
            other = self.add("piston_chamber")
            net.ports.append(f"{other}.chamber")
            self.join(other, fluid)

    def machine(self, barrel: str, fluid: str) -> None:
        """An axial piston machine: its barrel, the chambers of its pistons, and its valve plate."""
        pistons = {"pistons": str(self.random.randint(2, 4))}
        radius = text(units.length, self.random.uniform(30e-3, 40e-3))
        first, oil = self.add(barrel, pistons | {"pitch_radius": radius}), self.add("piston_chambers", pistons)
        plate = self.add("valve_plate", pistons | {"pitch_radius": radius})
        self.nets += [
            Net("chamber", [f"{first}.chambers", f"{oil}.chambers"]),
            Net("hydraulic", [f"{oil}.port", f"{plate}.chambers"], fluid, int(pistons["pistons"])),
        ]
        shaft = self.source("rotational", fluid)
        shaft.ports += [f"{first}.shaft", f"{plate}.shaft"]
        for port in ("suction", "delivery"):
            known = self.given("hydraulic", fluid)
            (self.random.choice(known) if known else self.source("hydraulic", fluid)).ports.append(f"{plate}.{port}")
        if barrel.startswith("variable"):
            self.join_signal(
                first,
                self.parsed[first],
                next(p for p in type(self.parsed[first]).ports() if p.name == "setting"),
                None,
            )

    # -- signals -----------------------------------------------------------------------------------

    def join_signal(self, name: str, part: Component, port: Port, size: int | None) -> None:
        """A signal input gets a source of its own; an output opens a net."""
        if port.role == "gives":
            self.nets.append(Net("signal", [f"{name}.{port.name}"]))
            return
        quantity = part.quantity(port.quantity or units.ratio).name
        for _ in range(1 if size is None else size):
            net = self.signal(quantity, 0)
            net.ports.append(f"{name}.{port.name}" if size is None else f"{name}.{port.name}[{_ + 1}]")

    def signal(self, quantity: str, depth: int) -> Net:
        """A net that carries a signal of this quantity."""
        low, high = SIGNALS.get(quantity, (0.0, 1.0))
        draw = self.random
        if depth < DEEPEST and draw.random() < 0.45:
            return self.through(draw.choice(THROUGH), quantity, depth)
        name = self.origin(draw.choice(ORIGINS), quantity, low, high)
        net = Net("signal", [f"{name}.y"])
        self.nets.append(net)
        return net

    def origin(self, kind: str, quantity: str, low: float, high: float) -> str:
        """A source of a signal within a range."""
        draw, of = self.random, QUANTITIES[quantity]
        a, b = sorted((draw.uniform(low, high), draw.uniform(low, high)))
        one, other = (text(of, v) for v in (draw.choice(((a, b), (b, a)))))
        fixed: dict[str, Any] = {"output_quantity": quantity}
        at = text(units.time, draw.uniform(0.0, 8e-3))
        if kind == "constant":
            fixed |= {"value": one}
        elif kind in ("step", "ramp"):
            fixed |= {"before": one, "after": other, "at": at}
        elif kind in ("sine", "chirp"):
            fixed |= {"mean": text(of, (a + b) / 2), "amplitude": text(of, (b - a) / 2)}
        elif kind == "pulse":
            width = draw.uniform(1e-3, 4e-3)
            fixed |= {
                "low": one,
                "high": other,
                "at": at,
                "width": text(units.time, width),
                "period": text(units.time, width * draw.uniform(1.3, 3)),
            }
        elif kind == "noise":
            fixed |= {
                "mean": text(of, (a + b) / 2),
                "standard_deviation": text(of, (b - a) / 6),
                "distribution": "uniform",
                "seed": str(draw.randint(1, 99)),
            }
        else:
            times = sorted(draw.uniform(0.0, 20e-3) for _ in range(4))
            values = [text(of, draw.uniform(a, b)) for _ in times]
            fixed = {"curve": {"x": [text(units.time, t) for t in times], "y": values}}
        return self.add(kind, fixed)

    def through(self, kind: str, quantity: str, depth: int) -> Net:
        """A part that makes a signal of this quantity from others."""
        draw, of = self.random, QUANTITIES[quantity]
        low, high = SIGNALS.get(quantity, (0.0, 1.0))
        size = max(abs(low), abs(high))
        sensed = draw.choice(
            [
                "pressure",
                "pressure",
                "speed",
                "length",
                "velocity",
                "flow",
                "angle",
                "force",
                "torque",
                "volume",
                "power",
            ]
        )
        input_low, input_high = SIGNALS[sensed]
        middle, wide = (input_low + input_high) / 2, input_high - input_low
        there = QUANTITIES[sensed]
        fixed: dict[str, Any] = {"output_quantity": quantity}
        inputs = {"u": quantity}
        if kind in (
            "gain",
            "integrator",
            "first_order_lag",
            "second_order_lag",
            "transfer_function",
            "relay",
            "table",
            "pid",
            "sampled_pid",
        ):
            inputs = {"u": sensed}
            fixed["input_quantity"] = sensed
            gain = {"per": text(there, wide)}
            if kind == "relay":
                fixed |= {"upper": text(there, middle + 0.1 * wide), "lower": text(there, middle - 0.1 * wide)}
                fixed |= {"on_value": text(of, high), "off_value": text(of, low)}
            elif kind == "table":
                fixed = {
                    "curve": {
                        "x": [text(there, input_low + k * wide / 3) for k in range(4)],
                        "y": [text(of, draw.uniform(low, high)) for _ in range(4)],
                    }
                }
            elif kind in ("pid", "sampled_pid"):
                inputs = {"setpoint": sensed, "measured": sensed}
                fixed |= gain | {
                    "gain": text(of, draw.uniform(0.2, 1.0) * size),
                    "low": text(of, low),
                    "high": text(of, high),
                }
                fixed["integral_time"] = text(units.time, draw.uniform(5e-3, 50e-3))
                if draw.random() < 0.3:
                    fixed["derivative_time"] = text(units.time, draw.uniform(0.5e-3, 2e-3))
            elif kind == "integrator":
                fixed |= gain | {"rate": text(of, 0.5 * size), "within": text(units.time, 20e-3)}
            else:
                fixed |= gain | {"gain": text(of, 0.5 * size)}
        if kind == "transfer_function":
            fixed |= {"numerator": ["1"], "denominator": ["1", f"{draw.uniform(0.4, 2):.3g}", "1"]}
        elif kind == "limiter":
            fixed |= {"low": text(of, low), "high": text(of, (low + 2 * high) / 3)}
        elif kind == "dead_band":
            fixed |= {"half_width": text(of, 0.1 * size)}
        elif kind == "quantizer":
            fixed |= {"step": text(of, size / draw.randint(3, 12))}
        elif kind == "rate_limiter":
            fixed |= {"rising": text(of, size), "within": text(units.time, draw.uniform(2e-3, 20e-3))}
        elif kind == "sum":
            inputs = {"u[1]": quantity, "u[2]": quantity}
            fixed |= {"weights": ["0.5", "0.5"]}
        elif kind == "product":
            inputs = {"u1": "ratio", "u2": quantity}
            fixed |= {"first_quantity": "ratio", "second_quantity": quantity}
        elif kind == "switch":
            inputs = {"u1": quantity, "u2": quantity, "control": sensed}
            fixed |= {"input_quantity": sensed, "threshold": text(there, middle)}
        elif kind == "expression":
            inputs = {"u1": quantity, "u2": "ratio"}
            fixed |= {"inputs": [quantity, "ratio"], "formula": "u1 * (0.5 + 0.4 * sin(300 * t / (1 s) + u2))"}
        elif kind == "table2d":
            inputs = {"u1": sensed, "u2": quantity}
            fixed = {"table": {
                "x": [text(there, input_low), text(there, middle), text(there, input_high)],
                "y": [text(of, low), text(of, high)],
                "z": [[text(of, draw.uniform(low, high)) for _ in range(2)] for _ in range(3)],
            }}  # fmt: skip
        elif kind == "spool_drive":
            if quantity != "ratio":
                return self.signal(quantity, depth)
            inputs, fixed = {"command": "ratio"}, {}
        elif kind == "spring_chamber_pressure":
            if quantity != "pressure":
                return self.signal(quantity, depth)
            inputs, fixed = {"flow": "flow"}, {"linear": "0.1 bar/(L/min)", "quadratic": "0 bar/(L/min)2"}
        elif kind == "energy_counter":
            if quantity != "energy":
                return self.signal(quantity, depth)
            inputs, fixed = {"power": "power"}, {}
        name = self.add(kind, fixed)
        output = {
            "spool_drive": "stroke",
            "pid": "output",
            "sampled_pid": "output",
            "spring_chamber_pressure": "pressure",
        }
        net = Net("signal", [f"{name}.{output.get(kind, 'y')}"])
        self.nets.append(net)
        for port, of_input in inputs.items():
            measured = of_input == sensed and draw.random() < 0.7 and kind in FED_BACK
            (self.sensor(of_input) if measured else self.signal(of_input, depth + 1)).ports.append(f"{name}.{port}")
        return net

    def use(self, net: Net, quantity: str) -> None:
        """Let a signal drive something."""
        kind, port = USES.get(quantity, ("", ""))
        if not kind:
            return
        name = self.add(kind)
        net.ports.append(f"{name}.{port}")
        self.join(name, "oil", but=port)

    def data(self, fluid: dict[str, str], stop: str) -> dict[str, Any]:
        """The circuit as data."""
        counts: dict[str, int] = {}
        nets: dict[str, Any] = {}
        islands = any(net.fluid == "other" for net in self.nets)
        for net in self.nets:
            counts[net.domain] = counts.get(net.domain, 0) + 1
            name = f"{LETTERS[net.domain]}{counts[net.domain]}"
            nets[name] = {"fluid": net.fluid, "ports": net.ports} if islands and net.fluid else net.ports
        fluids = {"fluids": {"oil": fluid, "other": FLUIDS[0]}} if islands else {"fluid": fluid}
        return {"crescentlab": "1", **fluids, "components": self.components, "nets": nets, "simulation": {"stop": stop}}

    def sensor(self, quantity: str) -> Net:
        """A sensor of this quantity on a net that exists, or on a new one."""
        name = self.add(self.random.choice(SENSORS[quantity]))
        self.join(name, "oil", 0.05)
        return next(n for n in self.nets if f"{name}.y" in n.ports)


USES = {
    "flow": ("signal_flow_source", "flow"), "force": ("signal_force_source", "force"),
    "torque": ("signal_torque_source", "torque"), "pressure": ("proportional_relief_valve", "setting"),
    "ratio": ("variable_orifice", "opening"),
}  # fmt: skip
"""What a signal of a quantity may drive, and at which port."""
ORIGINS = ("constant", "step", "ramp", "sine", "chirp", "pulse", "noise", "time_table")
"""Sources of signals."""
THROUGH = (
    "gain", "sum", "product", "limiter", "dead_band", "sample_and_hold", "delay", "pade_delay", "integrator",
    "first_order_lag", "second_order_lag", "transfer_function", "expression", "relay", "switch", "rate_limiter",
    "quantizer", "table", "table2d", "pid", "sampled_pid", "spool_drive", "spring_chamber_pressure",
)  # fmt: skip
"""Parts that make a signal from others."""
FED_BACK = {
    "integrator", "first_order_lag", "second_order_lag", "transfer_function", "relay", "switch", "sampled_pid",
}  # fmt: skip
"""Those whose output does not follow a measured input at once: they close no algebraic loop."""


def library() -> dict[str, type[Component]]:
    """The installed types."""
    return installed().components


def drawn() -> list[str]:
    """Types that a circuit may be asked to hold, forms of families left out."""
    forms = {f.type_name() for cls in library().values() if cls.family for f in cls.forms()}
    return [name for name in library() if name not in LEFT_OUT and name not in forms]


def text(quantity: Quantity, value: float) -> str:
    """A number in the unit that engineers use, of four digits."""
    unit = next(iter(quantity.units))
    return f"{(value - quantity.offsets.get(unit, 0.0)) / quantity.units[unit]:.4g} {unit}".rstrip()


def size_of(part: Component, port: Port) -> int | None:
    """The number of elements of a port, None for a scalar."""
    size = port.size
    found = getattr(part, size) if isinstance(size, str) else size(part) if callable(size) else size
    return found if isinstance(found, int) else None


FLUIDS: tuple[dict[str, str], ...] = (
    {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"},
    {"type": "aerated_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar",
     "air_fraction": "0.5 %", "saturation_pressure": "1000 bar"},
    {"type": "cavitating_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar",
     "vapour_pressure": "0.01 bar"},
    {"type": "mineral_oil", "grade": "ISO VG 46"},
    {"type": "water"},
)  # fmt: skip


def circuit_data(types: Sequence[str], seed: int, stop: str = "10 ms") -> dict[str, Any]:
    """A circuit with at least these parts, as data in the shape of a circuit file."""
    start = random.Random(f"{seed}")
    grown = Growing(seed, start.uniform(8e5, 50e5))
    grown.random = start
    fluid = start.choice(FLUIDS)
    for _ in range(2):
        grown.source("hydraulic", "oil")
    for k, kind in enumerate(types):
        grown.random = random.Random(f"{seed} {k} {kind}")
        if kind in BARREL:
            grown.machine(kind if kind in BARREL[:2] else BARREL[0], "oil")
        elif kind in SENSORS_OF and kind != "energy_counter":
            grown.join(grown.add(kind), "oil", 0.05)
        elif kind in ORIGINS:
            quantity = grown.random.choice(["flow", "force", "torque", "pressure"])
            low, high = SIGNALS[quantity]
            net = Net("signal", [f"{grown.origin(kind, quantity, low, high)}.y"])
            grown.nets.append(net)
            grown.use(net, quantity)
        elif kind in THROUGH or kind == "energy_counter":
            quantity = {"spool_drive": "ratio", "spring_chamber_pressure": "pressure", "energy_counter": "energy"}.get(
                kind, grown.random.choice(["flow", "force", "torque", "pressure"])
            )
            grown.use(grown.through(kind, quantity, 1), quantity)
        else:
            grown.join(grown.add(kind), "oil")
    return grown.data(fluid, stop)


SENSORS_OF = {kind for kinds in SENSORS.values() for kind in kinds}


def yaml_text(data: dict[str, Any]) -> str:
    """The circuit as a file."""
    return yaml.safe_dump(data, sort_keys=False, width=120)
