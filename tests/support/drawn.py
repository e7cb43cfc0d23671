"""Reads committed pictures back: their curves, in data units."""

import re
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

SVG = "{http://www.w3.org/2000/svg}"
POINT = re.compile(r"[ML] ([-0-9.e]+) ([-0-9.e]+)")


def lines_in(picture: Path, figure: "Figure") -> dict[str, Array]:
    """[k, 2] x and y of each line in the file that has an id in `figure`, read by that drawing's scales."""
    tree = ElementTree.parse(picture)
    figure.set_dpi(72.0)  # of the file: its unit is the point
    height = 72.0 * figure.get_size_inches()[1]
    lines = {}
    for panel in figure.axes:
        panel.get_xlim(), panel.get_ylim()  # these fix the scales
        for line in panel.lines:
            if (name := line.get_gid()) is None:
                continue
            (path,) = tree.findall(f".//{SVG}g[@id='{name}']/{SVG}path")
            points = np.array([[float(x), height - float(y)] for x, y in POINT.findall(path.get("d", ""))])
            lines[name] = panel.transData.inverted().transform(points)
    return lines
