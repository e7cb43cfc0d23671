"""What the numbers were measured on, in a line: they mean nothing without it."""

import os
import platform
import re
from dataclasses import asdict, dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Machine:
    """The machine as it was when the bench began."""

    cores: int
    processor: str
    kernel: str
    preemption: str
    python: str
    load: float
    memory_gib: float

    def sentence(self) -> str:
        """For people."""
        return (
            f"{self.cores} cores of {self.processor}, {self.memory_gib:.0f} GiB, Linux {self.kernel} "
            f"({self.preemption}), Python {self.python}, load {self.load:.2f} at the start"
        )

    def as_json(self) -> dict[str, object]:
        """For the JSON file."""
        return asdict(self)


def describe() -> Machine:
    """This machine, now."""
    return Machine(
        cores=len(os.sched_getaffinity(0)),
        processor=_processor(),
        kernel=platform.release(),
        preemption=_preemption(platform.version()),
        python=platform.python_version(),
        load=os.getloadavg()[0],
        memory_gib=os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30,
    )


def _processor() -> str:
    match = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return match[1] if match else platform.machine()


def _preemption(version: str) -> str:
    """Of the kernel's build line, "#1 SMP PREEMPT_DYNAMIC ..."."""
    match = re.search(r"PREEMPT\w*", version)
    return match[0] if match else "no preemption"
