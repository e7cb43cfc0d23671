"""Which axes have been homed, kept over restarts: by axis the serial number of the drive that found its home.

Read by the controller before its loop, written by the supervisor alone: the cycle never waits for a disk.
"""

import contextlib
import json
import logging
import os
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from axisync_schemas.cell import Cell
from axisync_schemas.internal import CONTROLLER_STATUS
from axisync_schemas.memory import Control, Mailbox, Word

_SERIALS: TypeAdapter[dict[str, int]] = TypeAdapter(dict[str, int])
_log = logging.getLogger(__name__)


def state_directory() -> Path:
    """What outlives a restart of the machine: systemd's, or the user's."""
    given = os.environ.get("STATE_DIRECTORY")
    if given:
        return Path(given.split(":")[0])
    base = os.environ.get("XDG_STATE_HOME")
    return Path(base or Path.home() / ".local" / "state") / "axisync"


class HomedFile:
    """`<state directory>/<cell>.homed.json`. Without a single axis that needs homing there is no such file."""

    def __init__(self, cell: Cell) -> None:
        self._names = [axis.name for axis in cell.axes]
        self._needed = any(axis.drive.homing is not None for axis in cell.axes)
        self._path = state_directory() / f"{cell.name}.homed.json"
        self._seen = 0

    def read(self) -> dict[str, int]:
        """Serial numbers by axis; what cannot be read counts as not homed."""
        if not self._needed:
            return {}
        try:
            return _SERIALS.validate_json(self._path.read_bytes())
        except FileNotFoundError:
            return {}
        except (OSError, ValidationError) as error:
            _log.error("homed_file=%s error=%r", self._path, str(error))
            return {}

    def follow(self, control: Control, status: Mailbox) -> None:
        """Writes what the controller has found out since the last call. A failure is logged, and tried again."""
        changes = control[Word.HOMED_CHANGES]
        payload = status.read() if self._needed and changes != self._seen else None
        if payload is None:
            return
        report = CONTROLLER_STATUS.validate_json(payload)
        drives = zip(self._names, report.drives, strict=True)
        try:
            self._write({name: drive.serial for name, drive in drives if drive.homed})
        except OSError as error:
            _log.error("homed_file=%s error=%r", self._path, str(error))
            return
        if report.homed_changes == changes:
            self._seen = changes

    def _write(self, serials: dict[str, int]) -> None:
        """As a whole or not at all, also when the machine loses power meanwhile."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        new = self._path.with_suffix(f".{os.getpid()}.tmp")
        try:
            with new.open("w", encoding="utf-8") as file:
                json.dump(serials, file)
                file.flush()
                os.fsync(file.fileno())
            new.replace(self._path)
        finally:
            with contextlib.suppress(FileNotFoundError):
                new.unlink()
