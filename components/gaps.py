"""Narrow gaps with laminar flow: flat slots and annuli, of fixed or signalled size. Drag by walls is not here."""

from pydantic import Field

from crescentlab.component import Component, Equations
from crescentlab.domain import observable, takes_pressure, takes_signal
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, maximum
from crescentlab.units import Flow, Length, Ratio

from .flow_laws import annular_flow, slot_flow


class LaminarGap(Component):
    r"""Flat gap of fixed height with laminar flow.

    .. math:: q = n \frac{b h^3}{12 \mu l} (p_a - p_b)

    b = `width` across the flow, h = `height`, l = `length` along the flow [m]; n = `parallel` [-] gaps side by
    side; p [Pa] gauge; \mu [Pa s] at the mean pressure. With `count` a vector of equal gaps, each between its own
    pair of ports. Not for turbulent flow, nor for walls that move along the flow.
    Source: plane Poiseuille flow; Rundo & Corvaglia (2016), Eqs. 20, 22 and 26.
    """

    width: Length = Field(gt=0, description="across the flow")
    height: Length = Field(ge=0, description="clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        q = self.parallel * slot_flow(p_a, p_b, self.width, self.height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class VariableHeightGap(Component):
    r"""Flat gap whose height a signal changes, for example by the deflection of a cover.

    .. math:: q = n \frac{b (h + k\,\Delta h)^3}{12 \mu l} (p_a - p_b)

    b = `width`, h = `height` at rest, l = `length` [m]; \Delta h = `change` [m], k = `change_factor` [-]; a
    height below 0 counts as 0; n = `parallel` [-] gaps side by side; p [Pa] gauge; \mu [Pa s] at the mean
    pressure. With `count` a vector of gaps that share one change. Not for turbulent flow.
    Source: Rundo & Corvaglia (2016), Eq. 17 (k = 1) and Eq. 18 (k = 0.75).
    """

    width: Length = Field(gt=0, description="across the flow")
    height: Length = Field(ge=0, description="clearance at zero change")
    length: Length = Field(gt=0, description="along the flow")
    change_factor: Ratio = Field(default=1.0, description="height gained per change signalled")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    change = takes_signal(Length, "change of the height, for all gaps")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, change: Expr, fluid: Fluid) -> Equations:
        height = self.height + self.change_factor * change
        q = self.parallel * slot_flow(p_a, p_b, self.width, height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class VariableWidthGap(Component):
    r"""Flat gap of which a signal opens a share of the width, for example while a volume exists.

    .. math:: q = n \frac{s b h^3}{12 \mu l} (p_a - p_b)

    s = `opening` [-], open share of b = `width` [m], below 0 counts as 0; h = `height`, l = `length` [m];
    n = `parallel` [-] gaps side by side; p [Pa] gauge; \mu [Pa s] at the mean pressure. With `count` a vector of
    gaps, each with its own opening. Not for turbulent flow. Source: Rundo & Corvaglia (2016), Eq. 22.
    """

    width: Length = Field(gt=0, description="across the flow, when fully open")
    height: Length = Field(ge=0, description="clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    opening = takes_signal(Ratio, "open share of the width", size="count")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, opening: Expr, fluid: Fluid) -> Equations:
        width = self.width * maximum(opening, 0.0)
        q = self.parallel * slot_flow(p_a, p_b, width, self.height, self.length, fluid)
        return {"q_a": q, "q_b": -q, "q": q}


class AnnularGap(Component):
    r"""Narrow annulus round an eccentric shaft or spool, laminar.

    .. math:: q = n \frac{\pi d c^3 (1 + 1.5 \varepsilon^2)}{12 \mu l} (p_a - p_b)

    d = `diameter` [m]; c = `clearance` [m], radial: half the difference of the two diameters;
    \varepsilon = `eccentricity` [-], offset of the axes over c; l = `length` [m]; n = `parallel` [-] gaps side by
    side; p [Pa] gauge; \mu [Pa s] at the mean pressure. With d = 2 R it is the paper's
    \pi R h^3 (1 + 1.5\varepsilon^2)/(6 \mu l). With `count` a vector of equal gaps. Not for tilted shafts, c close
    to d, turbulent flow or drag. Source: Rundo & Corvaglia (2016), Eq. 23.
    """

    diameter: Length = Field(gt=0, description="of the shaft")
    clearance: Length = Field(ge=0, description="radial clearance; 0 is closed")
    length: Length = Field(gt=0, description="along the flow")
    eccentricity: Ratio = Field(default=0.0, ge=0, le=1, description="offset of the axes over the clearance")
    parallel: Ratio = Field(default=1.0, ge=0, description="number of equal gaps side by side")
    count: int | None = Field(default=None, ge=0, description="size of the ports; none: scalar")

    a = takes_pressure("upstream", size="count")
    b = takes_pressure("downstream", size="count")
    q = observable(Flow, "flow from a to b", size="count")

    def equations(self, p_a: Expr, p_b: Expr, fluid: Fluid) -> Equations:
        one = annular_flow(p_a, p_b, self.diameter, self.clearance, self.eccentricity, self.length, fluid)
        q = self.parallel * one
        return {"q_a": q, "q_b": -q, "q": q}
