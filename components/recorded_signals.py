"""Measured signals: columns of a data file over time, read as far as a run needs them."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, ValidationInfo, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from crescentlab import units
from crescentlab.component import Component, Equations, structural
from crescentlab.data_files import DataFile, Recording, open_data, recording
from crescentlab.domain import gives_signal, scheduled
from crescentlab.errors import InputError
from crescentlab.fluid import Fluid
from crescentlab.maths import Expr, stack
from crescentlab.schedule import Schedule
from crescentlab.units import Time, normalise

from .interpolation import Beyond, on_piece, pieces
from .signal_quantities import QuantityName
from .signal_tables import extended

TIME = "time"
"""The usual title of the column of times."""


class _Titles:
    """Field annotation: a data file's name, relative to the circuit's folder; its titles are read at once."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._read)

    def _read(self, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, DataFile):
            return value
        if not isinstance(value, (str, Path)) or not str(value):
            raise PydanticCustomError("recording", "{reason}", {"reason": "write the name of a data file"})
        path = Path((info.context or {}).get("folder", ".")) / value
        try:
            return open_data(path, str(path))
        except InputError as error:
            raise _told(error) from None


def _told(error: InputError) -> PydanticCustomError:
    at = {"file": error.place.file, "line": error.place.line} if error.place else {}
    return PydanticCustomError("recording", "{reason}", {"reason": error.message, **at})


class RecordedSignal(Component):
    r"""Signal read from a data file: one of its columns over its time, or several of one quantity.

    .. math:: y = y_k + (y_{k+1} - y_k) \frac{\tau - \tau_k}{\tau_{k+1} - \tau_k} \text{ or } y = y_k \text{ (hold)},
              \quad \tau = t + \tau_0

    t [s]; \tau = time in the file [s]; \tau_0 = `offset` [s]; y in the SI unit of the column's quantity. The first line
    names the columns with units; columns are separated by commas, semicolons or tabs, `#` begins a comment. Times may
    not fall; rows of one time are a jump, from the first of them to the last. Every row is an exact stop at which the
    signal bends or jumps; the integration starts anew only where it jumps. Rows beyond the end of the run are not read,
    and no row is part of the equations, so a file may have millions. `beyond` its ends the signal holds the first and
    last value, goes on with the slopes there, or repeats. Not for noise that matters between the rows.
    Source: linear interpolation; sample and hold.
    """

    file: Annotated[DataFile, _Titles()] = Field(description="name of the data file, which lies beside the circuit's")
    column: str | None = Field(default=None, description="title of the column; default: the only one besides the times")
    columns: list[str] | None = Field(
        default=None, description="titles of several columns of one quantity, for a vector"
    )
    time_column: str | None = Field(
        default=None, description="title of the times; default: time, or the first of times"
    )
    interpolation: Literal["linear", "hold"] = Field(
        default="linear", description="straight lines between the rows, or each value until the next"
    )
    offset: Time = structural(default=0.0, description="time in the file at time 0 of the run")
    beyond: Beyond = Field(
        default="hold", description="before and after the rows: hold the value, its slope, or repeat"
    )
    output_quantity: QuantityName | None = Field(
        default=None, description="quantity of the signal; default: the unit's"
    )

    y = gives_signal("carried_quantity", "the recorded value, or values", size="width")
    piece = scheduled("present row: its time, values and slopes", by="schedule", size="piece_size")

    @model_validator(mode="after")
    def _titles_and_units_fit(self) -> Self:
        try:
            self.recording()
            self._scales()
        except InputError as error:
            raise _told(error) from None
        return self

    @property
    def width(self) -> int | None:
        """Number of columns, None for a single one."""
        return None if self.columns is None else len(self.columns)

    @property
    def degree(self) -> int:
        """Of what lies between two rows."""
        return 1 if self.interpolation == "linear" else 0

    @property
    def piece_size(self) -> int:
        """Time, values, slopes."""
        return 1 + (self.width or 1) * (self.degree + 1)

    @property
    def carried_quantity(self) -> str:
        """What is written, or the quantity of the first column's unit."""
        return self.output_quantity or self.file.quantity(self._places()[0]).name

    def _time(self) -> int:
        """Place of the column of times."""
        names = self.file.names
        if self.time_column is not None:
            return self.file.number_of(self.time_column)
        if TIME in names:
            return names.index(TIME)
        found = [k for k, title in enumerate(self.file.titles) if normalise(title.unit) in units.time.units]
        if not found:
            raise InputError(f"{self.file.path.name} has no column {TIME!r}; name one by time_column:", self.file.top)
        return found[0]

    def _places(self) -> list[int]:
        """Places of the columns of values."""
        if self.column is not None and self.columns is not None:
            raise InputError("write column: for one, or columns: for several, not both")
        if self.columns is not None:
            if not self.columns:
                raise InputError("columns: names none")
            return [self.file.number_of(name) for name in self.columns]
        if self.column is not None:
            return [self.file.number_of(self.column)]
        others = [name for k, name in enumerate(self.file.names) if k != self._time()]
        if len(others) != 1:
            said = f"{self.file.path.name} has {len(others)} columns besides the times"
            raise InputError(f"{said}; name one by column: {', '.join(others[:12]) or 'there is none'}")
        return [self.file.number_of(others[0])]

    def _scales(self) -> np.ndarray:
        """Factors and offsets to SI, shape (columns, 2)."""
        quantity = units.quantity_named(self.carried_quantity)
        return np.array([self.file.scale(k, quantity) for k in self._places()])

    def recording(self) -> Recording:
        """The rows, read as far as they have been asked for."""
        return recording(self.file, self._time(), self._places())

    def schedule(self, start: float, stop: float) -> Schedule:
        """The rows that a run between these times [s] meets."""
        rows = self.recording()
        times, values = rows.until(stop + self.offset)
        beyond = self.beyond
        inside = times[0] <= start + self.offset and times[-1] > stop + self.offset
        if beyond != "hold":
            if inside:  # neither end is met
                beyond = "hold"
            else:
                times, values = rows.until(math.inf)
                if not times[-1] > times[0]:
                    raise InputError(f"beyond: {beyond} needs rows of two times at least", self.file.top)
        scale = self._scales()
        course, reach = self.interpolation, (start, stop)
        return pieces(times - self.offset, values * scale[:, 0] + scale[:, 1], course, beyond, reach).schedule()

    def remarks(self, stop: float, fluid: Fluid | None = None) -> list[str]:
        """What `check` says of a run until ``stop`` [s]."""
        if self.beyond != "slope" or not self.degree:
            return []
        times = self.recording().until(stop + self.offset)[0] - self.offset
        return extended(self.file.path.name, times, self.beyond, stop)

    def equations(self, t: Expr, piece: Expr | None = None) -> Equations:
        if piece is None:  # a number's own row
            schedule = self.schedule(float(t), float(t))
            piece = schedule.rows[schedule.at(float(t))]
        values = [on_piece(t, piece, k, self.degree) for k in range(self.width or 1)]
        return {"y": values[0] if self.width is None else stack(*values)}
