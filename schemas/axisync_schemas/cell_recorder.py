"""The cell file's `[recorder]`: how the log is cut into files, and how much of it is kept."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from axisync_schemas.base import Strict
from axisync_schemas.cell_units import scaled


class Recording(Strict):
    """How the log is cut into files, and how much of it is kept in its directory."""

    rotate_after: Annotated[float, Field(ge=0.1, le=1440.0), *scaled(60.0)] = Field(
        alias="rotate_after_min", default=60.0
    )
    """A new file after this long (s)..."""
    rotate_size: Annotated[float, Field(ge=0.1, le=1e5), *scaled(1e6)] = Field(alias="rotate_size_mb", default=512.0)
    """...or at this size (bytes), whichever comes first."""
    keep: Annotated[float, Field(ge=0.0002), *scaled(1e9)] = Field(alias="keep_gb", default=20.0)
    """Finished files beyond this total (bytes) are deleted, the oldest first."""

    @model_validator(mode="after")
    def _holds_two(self) -> Self:
        if self.keep < 2 * self.rotate_size:
            raise ValueError(
                f"keep_gb is {self.keep / 1e9:g}, must hold at least two files of rotate_size_mb: "
                f"{2 * self.rotate_size / 1e9:g}"
            )
        return self
