"""The quantities that signals carry: fields that name them, and numbers read in their units. No components here.

A signal carries a quantity. A part reads it off the unit of a value (`after: 5 bar` is a pressure) or is told by
`output_quantity`, which is needed where the unit has several owners or the value is computed.
"""

from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from crescentlab import units
from crescentlab.errors import UnitError


def _known(name: str) -> str:
    try:
        return units.quantity_named(name).name
    except UnitError as error:
        raise PydanticCustomError("quantity", "{reason}", {"reason": error.message}) from None


def _reader(quantity_field: str, *, difference: bool = False) -> BeforeValidator:
    """Reads text in a unit of the quantity that `quantity_field`, declared earlier, names.

    A `difference` has no unit that counts from a zero of its own: 10 K, not 10 degC.
    """

    def read(value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, str):
            return value
        try:
            name = info.data.get(quantity_field)
            number, quantity = units.parse_any(value) if not name else (0.0, units.quantity_named(name))
            if difference:
                quantity.check_difference(value)
            return quantity.parse(value) if name else number
        except UnitError as error:
            raise PydanticCustomError("unit", "{reason}", {"reason": error.message}) from None

    return BeforeValidator(read)


QuantityName = Annotated[str, AfterValidator(_known)]
"""The name of a quantity of :mod:`crescentlab.units`."""

OutputValue = Annotated[float, _reader("output_quantity")]
"""A number of the quantity that `output_quantity` names; text with a unit, or SI."""

OutputDifference = Annotated[float, _reader("output_quantity", difference=True)]
"""A difference of two values of the quantity that `output_quantity` names; text with a unit, or SI."""

InputDifference = Annotated[float, _reader("input_quantity", difference=True)]
"""A difference of two values of the quantity that `input_quantity` names; text with a unit, or SI."""

InputValue = Annotated[float, _reader("input_quantity")]
"""A number of the quantity that `input_quantity` names; text with a unit, or SI."""


class Inferring(BaseModel):
    """Fills in the name of a quantity that is not written from the unit of a value that is."""

    inferred: ClassVar[dict[str, tuple[str, ...]]] = {"output_quantity": ()}

    @model_validator(mode="before")
    @classmethod
    def _infer(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        found = dict(data)
        for name, values in cls.inferred.items():
            written = [data[v] for v in values if isinstance(data.get(v), str)]
            if name not in found and written:
                try:
                    found[name] = units.parse_any(written[0])[1].name
                except UnitError:
                    continue  # the field's own reader says what is wrong
        return found
