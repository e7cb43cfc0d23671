"""`make test`: first what needs no clock, on all cores; then what runs real processes in real time: two at a time where
their cycle is slow, or is not there; the others one at a time.

On a machine shared with others a pause of 100 ms rightly stops drives, so what failed runs once more, by itself, and
that run decides (decision 23).
"""

import subprocess
import sys

KINDS = {
    "clockless": "not (campaign or system or vcan or web)",
    "unhurried": "unhurried and not campaign",
    "realtime": "(system or vcan or web) and not (unhurried or campaign)",
}
FOLDERS = {
    "clockless": ["tests"],
    "unhurried": ["tests/system"],
    "realtime": ["tests/system", "tests/vcan", "tests/web"],
}
OPTIONS = {
    "clockless": ["-n", "auto", "--dist", "worksteal"],
    "unhurried": ["-n", "2", "--dist", "loadfile"],  # a module's tests share its service
    "realtime": [],
}
FAILED, NONE_FOUND = 1, 5


def pytest(kind: str, given: list[str], *options: str) -> int:
    """Runs it in a process of its own, which remembers its own failures; its exit code."""
    command = [sys.executable, "-m", "pytest", "-m", KINDS[kind], "-o", f"cache_dir=.pytest_cache/{kind}", *options]
    return subprocess.run([*command, *(given or FOLDERS[kind])], check=False).returncode


def main(given: list[str]) -> int:
    """All tests, or those that `given` to pytest selects; 0 where all of them passed."""
    codes = {kind: pytest(kind, given, *OPTIONS[kind]) for kind in KINDS}
    if any(code not in (0, FAILED, NONE_FOUND) for code in codes.values()):
        return max(codes.values())
    for kind in [kind for kind, code in codes.items() if code == FAILED]:
        print(f"\nwhat failed ({kind}) runs once more, by itself", flush=True)
        codes[kind] = pytest(kind, given, "--last-failed", "--last-failed-no-failures", "none")
    if set(codes.values()) == {NONE_FOUND}:
        return NONE_FOUND
    return max((code for code in codes.values() if code != NONE_FOUND), default=0)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
