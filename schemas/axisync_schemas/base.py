"""The one strict base of all models."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, StringConstraints

NAME_PATTERN = r"^[A-Za-z0-9._-]{1,64}$"
Name = Annotated[str, StringConstraints(pattern=NAME_PATTERN)]
"""A user, cell, group, axis or bus name; safe inside a key expression and a file name."""


class Strict(BaseModel):
    """Unknown fields, NaN, infinity and silent coercion are refused; instances are frozen."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        validate_default=True,
        serialize_by_alias=True,
        validate_by_name=True,
        validate_by_alias=True,
        cache_strings="keys",  # ids of requests and moves never come again: remembering them only takes memory
    )
