"""The bench is run by path; its tests import its modules, and those of tests/, as it does."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
