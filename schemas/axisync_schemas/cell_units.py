"""Types of the cell file's values: the file carries units that people use, the attributes are SI."""

import math
from typing import Annotated

from pydantic import AfterValidator, Field, PlainSerializer


def scaled(factor: float) -> tuple[AfterValidator, PlainSerializer]:
    """Validator from the file's unit to SI, and back."""
    return AfterValidator(lambda x: x * factor), PlainSerializer(lambda x: x / factor, return_type=float)


Degrees = Annotated[float, AfterValidator(math.radians), PlainSerializer(math.degrees, return_type=float)]
Positive = Annotated[float, Field(gt=0)]
PositiveDegrees = Annotated[Positive, AfterValidator(math.radians), PlainSerializer(math.degrees, return_type=float)]
Milliseconds = Annotated[Positive, *scaled(1e-3)]
Kilobits = Annotated[Positive, *scaled(1e3)]
Percent = Annotated[Positive, *scaled(1e-2)]
