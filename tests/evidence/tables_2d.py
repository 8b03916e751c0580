"""Tables of two variables."""

from __future__ import annotations

import numpy as np
from crescentlab.components.tables_2d import Table2d
from scipy.interpolate import CubicSpline

from evidence import Number, evidence

X, Y = np.array([0.0, 1.0, 2.5, 3.0]), np.array([-1.0, 0.5, 2.0, 4.0, 4.5])
POINTS = ((0.4, 0.1), (1.7, 3.3), (2.9, -0.6), (1.0, 2.0), (4.0, 6.0), (-1.0, -2.0))


@evidence(
    "table2d",
    source="bilinear interpolation is exact for 2 - 3 x + 0.5 y + 1.5 x y, Press et al. (2007), section 3.6",
    tolerance=1e-14,
    because="rounding of double precision; values of size 20",
)
def bilinear() -> list[Number]:
    """A bilinear function on a grid of unequal steps, within it and beyond."""

    def f(x: float, y: float) -> float:
        return 2 - 3 * x + 0.5 * y + 1.5 * x * y

    table = Table2d(table={"x": X.tolist(), "y": Y.tolist(), "z": [[f(x, y) for y in Y] for x in X]})
    return [Number(f"at {x:g}, {y:g}", f(x, y), table.equations(u1=x, u2=y)["y"], size=20.0) for x, y in POINTS]


@evidence(
    "table2d",
    source="scipy.interpolate.CubicSpline with natural ends, along y for each x, then along x",
    tolerance=1e-13,
    because="rounding of double precision; values of size 1",
)
def bicubic() -> list[Number]:
    """sin(x) cos(y) on the same grid by a product of natural splines."""
    z = np.sin(X)[:, None] * np.cos(Y)
    table = Table2d(table={"x": X.tolist(), "y": Y.tolist(), "z": z.tolist()}, interpolation="spline")
    along_y = CubicSpline(Y, z, axis=1, bc_type="natural")
    return [
        Number(
            f"at {x:g}, {y:g}",
            float(CubicSpline(X, along_y(y), bc_type="natural")(x)),
            table.equations(u1=x, u2=y)["y"],
            size=1.0,
        )
        for x, y in POINTS[:4]
    ]
