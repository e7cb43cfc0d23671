"""Runs a command under user-mode Linux, with real vcan0 and vcan1, on the host's own files. Needs no root.

    python deploy/uml/run.py -- candump -n 1 vcan0

The command sees the host's files as this user does, its own processes and its own network (loopback, vcan0, vcan1); it
is root there. Output appears here as it comes; the exit code is the command's. One CPU, and slower than the host: for
function, not for timing. What it writes to the host's files is there when this program has ended.
Exit: the command's code, 124 after the time-out, 125 where the guest does not get as far as the command.
"""

import argparse
import contextlib
import ctypes
import mmap
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from console import Console
from guest import SYSTEM_PATH, script

KERNEL = Path("/usr/bin/linux.uml")
MODULES = Path("/usr/lib/uml/modules")
VCAN = Path(__file__).resolve().parents[1] / "vcan.sh"
TIMED_OUT, FAILED = 124, 125
HALT_S = 5.0
"""How long the guest may take to halt after its command, before it is killed."""
_PR_SET_PDEATHSIG = 1


def obstacle() -> str:
    """Why this machine cannot run it, in a sentence, or nothing."""
    if not sys.platform.startswith("linux"):
        return "user-mode Linux runs on Linux only"
    if not KERNEL.exists() or not list(MODULES.glob("*/kernel")):
        return f"there is no {KERNEL} (Debian: apt install user-mode-linux)"
    for command, package in (("insmod", "kmod"), ("ip", "iproute2"), ("mount", "mount"), ("stty", "coreutils")):
        if shutil.which(command, path=SYSTEM_PATH) is None:
            return f"there is no {command} (Debian: apt install {package})"
    return ""


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--timeout", type=float, default=600.0, metavar="S", help="seconds, by default 600")
    parser.add_argument("--memory", default="2G", help="the guest's memory, by default 2G; taken as it is used")
    parser.add_argument("--verbose", action="store_true", help="show boot messages")
    parser.add_argument("command", nargs="+", help="after --: program and arguments")
    options = parser.parse_args(arguments)
    if missing := obstacle():
        print(f"uml: {missing}", file=sys.stderr)
        return FAILED
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, _interrupted)
    with tempfile.TemporaryDirectory(prefix="axisync-uml-") as directory:
        return _run(Path(directory), options.command, options.memory, options.timeout, options.verbose)


def _interrupted(number: int, frame: object) -> None:
    raise SystemExit(128 + number)


def _run(directory: Path, command: Sequence[str], memory: str, timeout: float, verbose: bool) -> int:
    modules = sorted(MODULES.glob("*/kernel"))[-1]
    init = directory / "init"
    init.write_text(script(command, cwd=Path.cwd(), environment=os.environ, modules=modules, vcan=VCAN))
    init.chmod(0o700)  # it holds the environment
    console = Console()
    guest = _boot(directory, init, memory)
    try:
        ended = _forward(guest, console, time.monotonic() + timeout)
    finally:
        _end(guest, HALT_S if console.exit_code is not None else 0.0)
    if verbose or (not console.begun and ended):
        print(f"uml: console:\n{console.unread()}", file=sys.stderr)
    if console.exit_code is not None:
        return console.exit_code
    if not ended:
        print(f"uml: not done after {timeout:g} s: killed", file=sys.stderr)
        return TIMED_OUT
    print("uml: the guest ended without its command's exit code", file=sys.stderr)
    return FAILED


def _boot(directory: Path, init: Path, memory: str) -> "subprocess.Popen[bytes]":
    arguments = [
        str(KERNEL), "rootfstype=hostfs", "rootflags=/", "rw", f"mem={memory}", f"init={init}", f"uml_dir={directory}",
        "con=null", "con0=fd:0,fd:1", "quiet", "loglevel=1",
    ]  # fmt: skip
    return subprocess.Popen(
        arguments,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        env={"PATH": SYSTEM_PATH, "HOME": str(directory), "TMPDIR": str(_memory_directory(directory))},
        preexec_fn=_die_with(os.getpid()),
    )


def _die_with(parent: int) -> Callable[[], None]:
    """Has the guest end when this process does, even by SIGKILL. On SIGTERM it takes its own processes along."""
    libc = ctypes.CDLL(None)

    def prepare() -> None:
        libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        if os.getppid() != parent:
            os._exit(FAILED)

    return prepare


def _memory_directory(fallback: Path) -> Path:
    """Where the guest's memory is kept as a file: /dev/shm, unless it is small or not executable, as in containers."""
    shared = Path("/dev/shm")
    try:
        with tempfile.TemporaryFile(dir=shared) as file:
            file.truncate(mmap.PAGESIZE)
            mmap.mmap(file.fileno(), mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_EXEC).close()
        return shared if shutil.disk_usage(shared).free > 1 << 30 else fallback
    except OSError:
        return fallback


def _forward(guest: "subprocess.Popen[bytes]", console: Console, deadline: float) -> bool:
    """Prints the command's output until the console ends or the exit code is known; False where time runs out."""
    assert guest.stdout is not None
    with selectors.DefaultSelector() as selector:
        selector.register(guest.stdout, selectors.EVENT_READ)
        while console.exit_code is None:
            left = deadline - time.monotonic()
            if left <= 0 or not selector.select(left):
                return False
            data = os.read(guest.stdout.fileno(), 65536)
            if not data:
                return True
            sys.stdout.buffer.write(console.feed(data))
            sys.stdout.buffer.flush()
    return True


def _end(guest: "subprocess.Popen[bytes]", patience: float) -> None:
    """Waits `patience` seconds for a guest that is halting; then ends it and every process of its session."""
    assert guest.stdout is not None
    for wait, ending in ((patience, guest.terminate), (HALT_S, guest.kill)):
        try:
            guest.wait(wait)
            break
        except subprocess.TimeoutExpired:
            ending()
    guest.stdout.close()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(guest.pid, signal.SIGKILL)
    guest.wait()


if __name__ == "__main__":
    sys.exit(main())
