"""Says in a sentence why this interpreter cannot make the project's environment. Runs on any Python 3."""

import sys

MINIMUM = (3, 11)


def obstacle() -> str:
    """What is missing and how to get it, or nothing."""
    version = str(sys.version_info[0]) + "." + str(sys.version_info[1])
    if sys.version_info[:2] < MINIMUM:
        return (
            "axisync needs Python 3.11 or newer, and " + sys.executable + " is " + version + ". "
            "Install a newer one and name it: make PYTHON=python3.11 ..."
        )
    if not sys.platform.startswith("linux"):
        return "axisync runs on Linux only: it needs SocketCAN, memfd and SCHED_FIFO."
    try:
        import ensurepip
        import venv
    except ImportError as error:
        return (
            "Python " + version + " has no module " + str(error.name) + ", so no environment can be made. "
            "On Debian and Ubuntu: apt install python" + version + "-venv"
        )
    del ensurepip, venv
    return ""


if __name__ == "__main__":
    sys.exit(obstacle() or 0)
