"""Prints the doctor's findings, for people or for programs."""

import json
from dataclasses import asdict

from axisync_service.doctor.facts import Facts
from axisync_service.doctor.findings import Finding, Level, dangerous
from axisync_service.doctor.latency import Latency

_MARKS = {Level.OK: "ok     ", Level.ADVICE: "advice ", Level.DANGER: "DANGER "}
VERDICTS = {False: "fit for the cycle", True: "the cycle would be in danger here"}


def as_json(facts: Facts, latency: Latency | None, found: list[Finding]) -> str:
    """Everything, one object."""
    whole = {
        "fit": not dangerous(found),
        "findings": [asdict(finding) for finding in found],
        "facts": asdict(facts),
        "latency": asdict(latency) if latency is not None else None,
    }
    return json.dumps(whole, indent=2)


def as_text(found: list[Finding]) -> str:
    """A line each, what to change below it, and the verdict."""
    lines = []
    for finding in found:
        lines.append(f"{_MARKS[finding.level]} {finding.what:<20}{finding.says}")
        if finding.fix is not None and finding.level is not Level.OK:
            lines.append(f"{'':<28}-> {finding.fix}")
    return "\n".join([*lines, "", f"verdict: {VERDICTS[dangerous(found)]}"])
