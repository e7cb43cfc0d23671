"""The script that user-mode Linux runs as its init."""

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

MODULES = ("net/can/can.ko", "net/can/can-raw.ko", "drivers/net/can/dev/can-dev.ko", "drivers/net/can/vcan.ko")
"""In the order in which they depend on one another."""

SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"

# /tmp stays the host's, so that files given by path are found; temporary files go to memory.
# No bytecode is written: what the guest had not yet written back when it is killed would damage the host's environment.
_TEMPLATE = """#!/bin/sh
export PATH={path}
mount -t proc proc /proc && mount -t sysfs sys /sys && mount -t tmpfs run /run || exit 1
mkdir -p /dev/shm /dev/pts /run/tmp && mount -t tmpfs shm /dev/shm && mount -t devpts pts /dev/pts
for module in {modules}; do insmod {directory}/$module || exit 1; done
ip link set lo up
{vcan} {interfaces} >/dev/null || exit 1
stty -opost -echo
{environment}
export TMPDIR=/run/tmp PYTHONDONTWRITEBYTECODE=1
cd {cwd} || exit 1
printf '\\036AXISYNC-UML-BEGIN\\n'
{command} </dev/null 2>&1
code=$?
sync
printf '\\036AXISYNC-UML-END %d\\n' $code
halt -f
"""

_NOT_PASSED = {"PATH", "TMPDIR", "TMP", "TEMP", "PWD", "OLDPWD", "SHLVL", "_", "LISTEN_FDS", "LISTEN_PID"}
_VARIABLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def script(
    command: Sequence[str],
    *,
    cwd: Path,
    environment: Mapping[str, str],
    modules: Path,
    vcan: Path,
    interfaces: Sequence[str] = ("vcan0", "vcan1"),
) -> str:
    """The init: mounts, modules, interfaces, then `command` between the console's marks.

    Args:
        command: program and arguments.
        cwd: where it runs.
        environment: its variables, PATH among them; those of the host's session are left out.
        modules: the kernel's directory of modules, `/usr/lib/uml/modules/VERSION/kernel`.
        vcan: deploy/vcan.sh.
        interfaces: CAN interfaces to bring up.
    """
    passed = {name: value for name, value in environment.items() if name not in _NOT_PASSED and _VARIABLE.match(name)}
    return _TEMPLATE.format(
        path=shlex.quote(f"{environment.get('PATH', '')}:{SYSTEM_PATH}".lstrip(":")),
        modules=" ".join(MODULES),
        directory=shlex.quote(str(modules)),
        vcan=shlex.quote(str(vcan)),
        interfaces=shlex.join(interfaces),
        environment="\n".join(f"export {name}={shlex.quote(value)}" for name, value in sorted(passed.items())),
        cwd=shlex.quote(str(cwd)),
        command=shlex.join(command),
    )
