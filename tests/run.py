"""`make test`: first what needs no clock, on all cores, then what runs real processes, one at a time.

The second kind runs a 2 ms cycle in real time beside whatever else the machine does, and a pause of 100 ms rightly
stops drives. So what failed runs once more, by itself, and that run decides (decision 23).
"""

import subprocess
import sys

PURE, REAL = "not campaign and not system and not vcan", "not campaign and (system or vcan)"
FAILED, NONE_FOUND = 1, 5


def pytest(*arguments: str) -> int:
    """Runs it in a process of its own; its exit code."""
    return subprocess.run([sys.executable, "-m", "pytest", *arguments], check=False).returncode


def main(given: list[str]) -> int:
    """All tests, or those that `given` to pytest selects; 0 where all of them passed."""
    codes = [pytest("-n", "auto", "--dist", "worksteal", "-m", PURE, *given), pytest("-m", REAL, *given)]
    if any(code not in (0, FAILED, NONE_FOUND) for code in codes):
        return max(codes)
    if FAILED in codes:
        print("\nwhat failed runs once more, by itself", flush=True)
        return pytest("-m", "not campaign", "--last-failed", "--last-failed-no-failures", "none", *given)
    return NONE_FOUND if set(codes) == {NONE_FOUND} else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
