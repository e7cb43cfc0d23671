"""Program files for clients: the errors of `axisync_schemas.programs` as those of this package."""

from pathlib import Path

from axisync_client.errors import InvalidArgument
from axisync_schemas.programs import Program, ProgramError, read_program


def load(program: Program | str | Path) -> Program:
    """The program, or that of a file.

    Raises:
        InvalidArgument: the file cannot be read or is refused; one line for each fault, with its path.
    """
    if isinstance(program, Program):
        return program
    try:
        return read_program(Path(program))
    except ProgramError as error:
        raise InvalidArgument(str(error)) from None
