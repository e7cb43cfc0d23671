"""An event as a line for people."""

from datetime import datetime

from rich.text import Text

from axisync_schemas.replies import Event

_STYLES = {"warning": "yellow", "error": "bold red"}


def event_line(event: Event) -> Text:
    """`12:00:01.500 controller kingkong move_started: message`, in local time."""
    about = f" {event.group}" if event.group and event.group not in event.message else ""
    text = f"{_local_time(event.wall_time)} {event.source}{about} {event.kind}: {event.message}"
    return Text(text, style=_STYLES.get(event.severity, ""))


def _local_time(stamp: str) -> str:
    try:
        return datetime.fromisoformat(stamp).astimezone().strftime("%H:%M:%S.%f")[:-3]
    except ValueError:
        return stamp
