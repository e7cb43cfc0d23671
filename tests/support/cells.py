"""The cell file of the demo, whole, or for tests that need less than two whole arms."""

import re
from importlib import resources


def eod_text() -> str:
    """The demo's cell file."""
    return resources.files("axisync_service").joinpath("cells/eod.toml").read_text(encoding="utf-8")


def small(text: str, axes: int = 2) -> str:
    """The demo's cell file, each arm with its first axes only, and without what is solid."""
    blocks = re.split(r"(?=\[\[groups\.axes\]\])", text)
    kept, seen = [], 0
    for block in blocks:
        if block.startswith("[[groups.axes]]"):
            seen += 1
            more = "[[groups]]" in block or "[[compounds]]" in block
            rest = block[block.index("\n\n") :] if "\n\n" in block and more else ""
            kept.append(block if seen <= axes else rest)
            seen = 0 if "[[groups]]" in block else seen
        else:
            kept.append(block)
    return "".join(kept).partition("[geometry]")[0]
