"""What is done with a cell file's text before the model sees it: other files taken in, defaults filled in.

The files that it names (URDF) are kept in its own text, so that one text says everything. They stand at its end as
tables: [files."arm.urdf"], text = '''...'''. What stands there is not read again.
"""

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path


class FileMissing(ValueError):
    """A file that the cell file names cannot be read; the message begins with the path of its key."""


def with_files(text: str, folder: Path) -> str:
    """The cell file's text with the files that it names and does not hold yet, from `folder`.

    Raises:
        FileMissing: one cannot be read.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return text  # parse_cell says what is wrong.
    held = dict(_held(data))
    for where, table in _urdf_tables(data):
        name = table.get("file")
        if isinstance(name, str) and "text" not in table and name not in held:
            held[name] = _read(folder / name, where)
            text += f"\n[files.{json.dumps(name)}]\ntext = {_quoted(held[name])}\n"
    return text


def with_texts(data: dict[str, object]) -> dict[str, object]:
    """The parsed cell file with `text` beside each `file`, and without the table of files."""
    held = dict(_held(data))
    for _, table in _urdf_tables(data):
        name = table.get("file")
        if isinstance(name, str) and name in held:
            table.setdefault("text", held[name])
    return {key: value for key, value in data.items() if key != "files"}


def _held(data: dict[str, object]) -> Iterator[tuple[str, str]]:
    files = data.get("files")
    for name, table in files.items() if isinstance(files, dict) else ():
        if isinstance(table, dict) and isinstance(table.get("text"), str):
            yield name, table["text"]


def _urdf_tables(data: dict[str, object]) -> Iterator[tuple[str, dict[str, object]]]:
    groups = data.get("groups")
    for number, group in enumerate(groups if isinstance(groups, list) else ()):
        if isinstance(group, dict) and isinstance(group.get("urdf"), dict):
            yield f"groups[{number}].urdf.file", group["urdf"]


def _read(path: Path, where: str) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileMissing(f"{where}: {path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise FileMissing(f"{where}: {path} is no text: {error}") from None


def _quoted(text: str) -> str:
    """As TOML: readable where it can be."""
    literal = "'''" not in text and all(c in "\t\n" or c.isprintable() for c in text)
    return f"'''\n{text}'''" if literal else json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def with_defaults(data: dict[str, object]) -> dict[str, object]:
    """Fills each group's `defaults` (limits, stop_limits, soft_limits_deg, drive...) into its axes; axes win."""
    groups = data.get("groups")
    if not isinstance(groups, list):
        return data
    return {**data, "groups": [_group_with_defaults(g) if isinstance(g, dict) else g for g in groups]}


def _group_with_defaults(group: dict[str, object]) -> dict[str, object]:
    defaults, axes = group.get("defaults"), group.get("axes")
    rest = {key: value for key, value in group.items() if key != "defaults"}
    if not isinstance(defaults, dict) or not isinstance(axes, list):
        return group
    return {**rest, "axes": [_merged(defaults, axis) if isinstance(axis, dict) else axis for axis in axes]}


def _merged(low: dict[str, object], high: dict[str, object]) -> dict[str, object]:
    result = dict(low)
    for key, value in high.items():
        below = result.get(key)
        result[key] = _merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return result
