"""Writes units.md, the table of all accepted units, from crescentlab.units: python docs/make_units_table.py"""

from __future__ import annotations

from pathlib import Path

from crescentlab.units import DISPLAY, QUANTITIES, Quantity

HEAD = """# Units

Written by `docs/make_units_table.py` from `crescentlab/units.py`; a test keeps the two together.

Each quantity accepts its own units and no others: a speed reads `1/min` as revolutions per minute and refuses `Hz`,
and `5 Nm` is a torque and nothing else. A power may be written in three ways, `mm2`, `mm^2` and `mm²`; `µm` is `um`;
a space, `·` and `*` between units are the same (`N m`, `N·m`). A number without a unit is a ratio or a count; every
other quantity needs its unit. Inside crescentlab, and in result files, everything is in the SI unit.

| quantity | SI unit | accepted units | shown in |
|---|---|---|---|
"""


def row(quantity: Quantity) -> str:
    """One line of the table."""
    units = ", ".join(f"`{unit}`" for unit in quantity.units if unit)
    none = "none, " if "" in quantity.units else ""
    shown = DISPLAY.get(quantity.name, quantity.si)
    return f"| {quantity.title} | {quantity.si} | {none}{units} | {shown} |\n"


def table() -> str:
    """The whole page."""
    return HEAD + "".join(row(quantity) for quantity in QUANTITIES.values())


if __name__ == "__main__":
    (Path(__file__).parent / "units.md").write_text(table(), encoding="utf-8")
