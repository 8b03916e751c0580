"""The numbers of the circuit as a C header, each under the name of what it is; no number of the pump stands in C."""

from __future__ import annotations

from typing import Any

import numpy as np

from crescentlab.elaborate import Design

SAME_SLOPE = 1e-9
"""Pieces of the cover's curve whose slopes agree to this are one piece."""
STRICT = "the flat equations leave out what this circuit does not have: "


def header(design: Design) -> str:
    """``parameters.h`` for this design."""
    parts = {name: instance.component for name, instance in design.instances.items()}
    (fluid,) = design.fluids.values()
    _check(parts)
    numbers = _oil(fluid) | _gears(parts) | _gaps(parts) | _valve(parts) | _line(parts, design)
    lines = [f"#define {name} {value!r}" for name, value in numbers.items()]
    return "\n".join([*lines, *_cover(parts["delivery"].deflection), *_segments(design), ""])


def _check(parts: dict[str, Any]) -> None:
    """Refuse what the flat equations rely on and this design does not keep."""
    holes, spool, gears = parts["relief.holes"], parts["relief.spool"], parts["gears"]
    kept = {
        "gaps 4 and 6 open": parts["gap_4"].height == 0 == parts["gap_6"].height,
        "rough walls": parts["line.duct"].roughness == 0 == parts["line.pipe"].roughness,
        "a spool that lifts beyond its holes": spool.high < holes.diameter - holes.edge_rounding + holes.overlap,
        "holes open at the low stop": spool.low <= holes.overlap,
        "a rebounding spool": spool.restitution == 0,
        "another number of volumes in a chain": parts["driver"].volumes == 1 == parts["driven"].volumes,
        "mean volumes": gears.volumes == "instantaneous",
        "another phase at the start": gears.phase_at_zero == 0 == parts["shaft"].start_angle,
        "another pressure in the sump": parts["sump"].pressure == 0,
        "another number of cells in the line": parts["line.pipe"].cells == 10,
        "several equal orifices": parts["inlet"].parallel == 1 == parts["throttle"].parallel,
    }
    for what, holds in kept.items():
        if not holds:
            raise ValueError(STRICT + what)


def _oil(fluid: Any) -> dict[str, float]:
    return {
        "ATMOSPHERE": fluid.atmospheric_pressure, "LIQUID_DENSITY": fluid.liquid_density, "VISCOSITY": fluid.viscosity,
        "LIQUID_MODULUS": fluid.liquid_modulus, "AIR_FRACTION": fluid.air_fraction,
        "SATURATION_PRESSURE": fluid.saturation_pressure, "POLYTROPIC_INDEX": fluid.polytropic_index,
        "MINIMUM_PRESSURE": fluid.minimum_pressure, "DISSOLUTION_ROUNDING": fluid.dissolution_rounding,
        "RHO_0": float(fluid.rho_0),
    }  # fmt: skip


def _gears(parts: dict[str, Any]) -> dict[str, float]:
    chambers = parts["gears"].chambers
    mesh, driver, driven = chambers.mesh, parts["driver"], parts["driven"]
    return {
        "DRIVER_TEETH": mesh.driver_teeth, "DRIVEN_TEETH": mesh.driven_teeth, "PITCH": mesh.pitch,
        "DRIVER_BASE": float(mesh.driver_base), "DRIVEN_BASE": float(mesh.driven_base),
        "DRIVER_TIP": mesh.driver_tip, "DRIVEN_TIP": mesh.driven_tip, "NU_01": float(mesh.nu_01),
        "ROLL_OFFSET": float(mesh.driven_roll(0.0)), "THICKNESS": chambers.thickness,
        "TRAPPED_AT_START": float(chambers.trapped_at_start), "DRIVER_SPACE": driver.volume,
        "DRIVEN_SPACE": driven.volume, "TIP_CLEARANCE": driver.gap_height, "DRIVER_TIP_LAND": driver.gap_length,
        "DRIVEN_TIP_LAND": driven.gap_length, "WALL_AREA": parts["delivery"].wall_area,
        "ANNULAR_VOLUME": parts["annular"].volume,
    }  # fmt: skip


def _gaps(parts: dict[str, Any]) -> dict[str, float]:
    roots, faces, root_2, face_2 = (parts[f"gap_{n}"] for n in ("1_roots", "1_faces", "2_roots", "2_faces"))
    inlet = parts["inlet"]
    return {
        "GAP_1_PARALLEL": roots.parallel, "GAP_1_ROOTS_WIDTH": roots.width, "GAP_1_ROOTS_LENGTH": roots.length,
        "GAP_1_FACES_WIDTH": faces.width, "GAP_1_FACES_LENGTH": faces.length, "COVER_CLEARANCE": roots.height,
        "COVER_FACES": faces.change_factor, "GAP_2_PARALLEL": root_2.parallel,
        "GAP_2S_PARALLEL": parts["gap_2_roots_suction"].parallel, "GAP_2_ROOTS_AREA": root_2.area,
        "GAP_2_ROOTS_DIAMETER": root_2.hydraulic_diameter, "GAP_CD": root_2.cd_max, "GAP_LAMBDA": root_2.lambda_c,
        "GAP_2_FACES_WIDTH": face_2.width, "GAP_2_FACES_HEIGHT": face_2.height, "GAP_2_FACES_LENGTH": face_2.length,
        "GAP_7_DIAMETER": parts["gap_7"].diameter, "GAP_7_CLEARANCE": parts["gap_7"].clearance,
        "GAP_7_LENGTH": parts["gap_7"].length, "GAP_7_ECCENTRICITY": parts["gap_7"].eccentricity,
        "GAP_9_WIDTH": parts["gap_9"].width, "GAP_9_HEIGHT": parts["gap_9"].height,
        "GAP_9_LENGTH": parts["gap_9"].length, "INLET_AREA": inlet.area, "INLET_CD": inlet.cd_max,
        "INLET_LAMBDA": inlet.lambda_c, "INLET_DIAMETER": round_diameter(inlet),
    }  # fmt: skip


def round_diameter(orifice: Any) -> float:
    """Hydraulic diameter [m] of a round hole, as the orifice rounds it."""
    return float(np.sqrt(4 * orifice.area / np.pi + orifice.diameter_rounding**2))


def _valve(parts: dict[str, Any]) -> dict[str, float]:
    holes, spool, chamber = parts["relief.holes"], parts["relief.spool"], parts["relief.chamber"]
    return {
        "SPOOL_MASS": spool.mass, "LOW_STOP": spool.low, "HIGH_STOP": spool.high,
        "SPOOL_DIAMETER": parts["relief.nose"].diameter, "HOLE_NUMBER": holes.number, "HOLE_DIAMETER": holes.diameter,
        "HOLE_OVERLAP": holes.overlap, "HOLE_CD": holes.cd_max, "HOLE_LAMBDA": holes.lambda_c,
        "JET_ANGLE": holes.jet_angle, "JET_COEFFICIENT": holes.jet_coefficient, "EDGE_ROUNDING": holes.edge_rounding,
        "DROP_ROUNDING": holes.drop_rounding, "SPRING_RATE": parts["relief.spring"].stiffness,
        "SPRING_PRELOAD": parts["relief.spring"].preload, "DAMPING": parts["relief.damper"].coefficient,
        "CHAMBER_LINEAR": chamber.linear, "CHAMBER_QUADRATIC": chamber.quadratic,
    }  # fmt: skip


def _line(parts: dict[str, Any], design: Design) -> dict[str, float]:
    duct, pipe = parts["line.duct"], parts["line.pipe"]
    return {
        "DUCT_DIAMETER": duct.diameter, "DUCT_LENGTH": duct.length, "DUCT_LOSS": duct.loss_coefficient,
        "FILTER_VOLUME": parts["line.filter"].volume, "BODY_VOLUME": parts["line.body"].volume,
        "LINE_DIAMETER": pipe.diameter, "LINE_LENGTH": pipe.length, "LINE_LOSS": pipe.loss_coefficient,
        "TICK": tick_of(design),
    }  # fmt: skip


def tick_of(design: Design) -> float:
    """Time [s] from one step of the line to the next."""
    (fluid,), pipe = design.fluids.values(), design.instances["line.pipe"].component
    speed = np.sqrt(fluid.bulk_modulus(pipe.max_pressure) / fluid.density(pipe.max_pressure))
    return float(pipe.courant_number * pipe.cell / speed)


def _cover(curve: Any) -> list[str]:
    """The cover's curve; its knots without a kink are left out, for nothing happens there."""
    slopes = np.diff(curve.y) / np.diff(curve.x)
    first = [0, *(k for k in range(1, len(slopes)) if abs(slopes[k] / slopes[k - 1] - 1) > SAME_SLOPE)]
    tables = {
        "COVER_KNOT": [curve.x[k] for k in first], "COVER_HEIGHT": [curve.y[k] for k in first],
        "COVER_SLOPE": [float(slopes[k]) for k in first],
    }  # fmt: skip
    lines = [f"static const double {name}[] = {{{', '.join(map(repr, row))}}};" for name, row in tables.items()]
    return [*lines, f"#define COVER_PIECES {len(first)}"]


def segments(design: Design) -> tuple[list[list[float]], float]:
    """The pitch cut where a volume opens, closes, begins or ends, between which all is smooth; and the pitch [rad].

    Each row: where it begins, which of trapped, driver's and driven gear's volume exist, the constants of the delivery
    and suction volumes, and whether a driver's or a driven gear's volume closes at its beginning.
    """
    gears = design.instances["gears"].component
    now = gears.chambers
    opens = ((now.driver_opens, now.driver_space), (now.driven_opens, now.driven_space))
    closes = ((now.driver_closes, now.driver_space), (now.driven_closes, now.driven_space))
    delivery = gears.delivery_volume_mean + float(now.delivery_change(0.0))
    suction = gears.suction_volume_mean + float(now.suction_change(0.0, 1.0)) + float(now.trapped_at_start)
    cuts = {0.0, float(now.mesh.duration), *(float(angle) for angle, _ in (*opens, *closes))}
    rows = []
    for nu in sorted(cuts):
        row = [nu, int(nu < now.mesh.duration)]
        row += [int(nu < o or nu >= c) for (o, _), (c, _) in zip(opens, closes, strict=True)]
        row += [float(delivery + sum(space for angle, space in opens if nu >= angle))]
        row += [float(suction - sum(space for angle, space in closes if nu >= angle))]
        rows.append([*row, *(int(nu == angle) for angle, _ in closes)])
    return rows, float(now.mesh.pitch)


def _segments(design: Design) -> list[str]:
    rows = ["{" + ", ".join(map(repr, row)) + "}" for row in segments(design)[0]]
    fields = "double begins; int trapped, driver, driven; double delivery, suction; int driver_closes, driven_closes;"
    return [
        f"typedef struct {{ {fields} }} Segment;",
        f"static const Segment SEGMENT[] = {{{', '.join(rows)}}};",
        f"#define SEGMENTS {len(rows)}",
    ]
