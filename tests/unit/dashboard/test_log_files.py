"""Only log files are served, and only those right there."""

import os
from pathlib import Path

from axisync_dashboard.log_files import log_files, path_of
from axisync_dashboard.panels.programs import programs_in


def test_the_newest_log_comes_first_and_nothing_else_is_listed(tmp_path: Path) -> None:
    for age, name in enumerate(("new.mcap", "old.mcap", "notes.txt")):
        (tmp_path / name).write_bytes(b"x" * 10)
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    files = log_files(str(tmp_path))
    assert files is not None
    assert [file.name for file in files] == ["new.mcap", "old.mcap"]
    assert path_of(str(tmp_path), "old.mcap") == tmp_path / "old.mcap"
    for name in ("notes.txt", "../old.mcap", "none.mcap", ""):
        assert path_of(str(tmp_path / "sub"), name) is None
        assert path_of(str(tmp_path), name) is None


def test_a_directory_elsewhere_is_none(tmp_path: Path) -> None:
    assert log_files(str(tmp_path / "elsewhere")) is None
    assert programs_in(None) == {}
    (tmp_path / "tool_change.toml").touch()
    assert programs_in(tmp_path) == {"tool change": tmp_path / "tool_change.toml"}
