"""Programs: the service's files, or one of yours; planned whole before it runs."""

from collections.abc import Callable
from pathlib import Path

from nicegui import events, ui

from axisync_dashboard.panels.arms import ArmsView
from axisync_dashboard.panels.joints import speed_field, speed_of
from axisync_dashboard.panels.preview import Preview, Wish
from axisync_dashboard.tab import Tab
from axisync_schemas.programs import Program, ProgramError, parse_program, read_program

UPLOAD_MAX = 256 * 1024


def programs_in(directory: Path | None) -> dict[str, Path]:
    """Program files by name."""
    if directory is None or not directory.is_dir():
        return {}
    return {path.stem.replace("_", " "): path for path in sorted(directory.glob("*.toml"))}


class Programs:
    """Choose or upload, look at it, plan it, run it."""

    def __init__(self, tab: Tab, arms: ArmsView | None, directory: Path | None) -> None:
        self._program: Program | None = None
        self._preview: Preview
        self._tab = tab
        self._files = programs_in(directory)
        choice = ui.select(list(self._files), label="Program", on_change=lambda event: self._choose(event.value))
        choice.props("dense outlined options-dense").set_visibility(bool(self._files))
        ui.upload(label="or drop a .toml file here", on_upload=self._upload, auto_upload=True).props(
            f"flat bordered accept=.toml max-file-size={UPLOAD_MAX}"
        ).classes("upload")
        self._about = ui.element("div").classes("about")
        self._speed = speed_field(lambda: self._preview.forget(), 100, "% of the program's own")
        self._preview = Preview(tab, arms, self.wish, "Run")

    def wish(self) -> Wish:
        """The program as a move.

        Raises:
            ValueError: none is chosen.
        """
        if self._program is None:
            raise ValueError("Choose a program first.")
        program = self._program
        return Wish(program.group, program.move, program.speed_scale * speed_of(self._speed))

    def _choose(self, name: str | None) -> None:
        if name is not None:
            self._load(lambda: read_program(self._files[name]))

    async def _upload(self, upload: events.UploadEventArguments) -> None:
        try:
            text = (await upload.file.read()).decode("utf-8")
        except UnicodeDecodeError:
            return self._tell([f"{upload.file.name} is no text."])
        return self._load(lambda: parse_program(text, upload.file.name))

    def _load(self, read: Callable[[], Program]) -> None:
        self._preview.forget()
        self._program = None
        try:
            self._program = read()
        except ProgramError as error:
            self._tell(str(error).splitlines())
            return
        steps = len(self._program.move.steps) if self._program.move.kind == "sequence" else 1
        where = f"{self._program.group}, {steps} step{'s' if steps != 1 else ''}"
        self._tell([self._program.name, where, self._program.description])

    def _tell(self, lines: list[str]) -> None:
        self._about.clear()
        with self._about:
            for line in filter(None, lines):
                ui.label(line)
