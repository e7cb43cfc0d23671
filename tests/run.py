"""`make test`: first what needs no clock, on all cores; then what runs real processes, in real time.

Of these one test at a time is of the 2 ms cycle. Beside them run those of slower cycles: the browser's, and vcan's
under user-mode Linux. On a machine shared with others a pause of 100 ms rightly stops drives, so what failed runs
once more, by itself, and that run decides (decision 23).
"""

import os
import subprocess
import sys
import tempfile
from typing import IO

Pytest = subprocess.Popen[bytes]

KINDS = {
    "clockless": "not (campaign or system or vcan or web)",
    "system": "system and not campaign",
    "slow": "(vcan or web) and not campaign",
}
FOLDERS = {"clockless": ["tests"], "system": ["tests/system"], "slow": ["tests/web", "tests/vcan"]}
FAILED, NONE_FOUND = 1, 5
SLOW_NICE = 5
"""So that they leave the processor to the clients of the others."""


def begin(kind: str, given: list[str], *options: str, output: IO[bytes] | None = None, nice: int = 0) -> Pytest:
    """Starts it in a process of its own, which remembers its own failures."""
    command = [sys.executable, "-m", "pytest", "-m", KINDS[kind], "-o", f"cache_dir=.pytest_cache/{kind}", *options]
    return subprocess.Popen([*command, *(given or FOLDERS[kind])], stdout=output, preexec_fn=lambda: os.nice(nice))


def first_runs(given: list[str]) -> dict[str, int]:
    """The exit codes by kind."""
    codes = {"clockless": begin("clockless", given, "-n", "auto", "--dist", "worksteal").wait()}
    with tempfile.TemporaryFile() as output:
        slow = begin("slow", given, output=output, nice=SLOW_NICE)
        codes["system"] = begin("system", given).wait()
        codes["slow"] = slow.wait()
        output.seek(0)
        print(output.read().decode(errors="replace"), flush=True)
    return codes


def main(given: list[str]) -> int:
    """All tests, or those that `given` to pytest selects; 0 where all of them passed."""
    codes = first_runs(given)
    if any(code not in (0, FAILED, NONE_FOUND) for code in codes.values()):
        return max(codes.values())
    again = [kind for kind, code in codes.items() if code == FAILED]
    for kind in again:
        print(f"\nwhat failed ({kind}) runs once more, by itself", flush=True)
        codes[kind] = begin(kind, given, "--last-failed", "--last-failed-no-failures", "none").wait()
    if set(codes.values()) == {NONE_FOUND}:
        return NONE_FOUND
    return max((code for code in codes.values() if code != NONE_FOUND), default=0)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
