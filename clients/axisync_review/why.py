"""For each stop, fault, refusal or gap of a log, the chain of evidence in a few lines."""

from collections.abc import Iterator
from dataclasses import replace

from axisync_review.findings import Findings
from axisync_review.incidents import Evidence, Incident, incidents
from axisync_review.missing import gap_incidents
from axisync_schemas.base import Strict

TOGETHER_NS = 25_000_000
"""What several axes say within this time, in the same words, is one fact."""
LINES_MAX = 14
"""Evidence of one incident; what is left out in the middle is counted."""


class EvidenceReview(Strict):
    """One fact; `t_s` counts from the first tick."""

    t_s: float
    source: str
    text: str
    tick: int | None = None


class WhyReview(Strict):
    """One incident with its evidence."""

    kind: str
    t_s: float
    message: str
    group: str | None
    tick: int | None
    evidence: tuple[EvidenceReview, ...]


def why(found: Findings) -> list[WhyReview]:
    """All incidents, and the gaps of the log, by time."""
    every = sorted([*incidents(found), *gap_incidents(found)], key=lambda incident: incident.log_time_ns)
    return [_review(found, incident) for incident in every]


def _review(found: Findings, incident: Incident) -> WhyReview:
    return WhyReview(
        kind=incident.kind,
        t_s=found.t_s(incident.log_time_ns),
        message=incident.message,
        group=incident.group,
        tick=incident.tick,
        evidence=tuple(_fact(found, evidence) for evidence in joined(incident.evidence, _axis_names(found))),
    )


def _axis_names(found: Findings) -> frozenset[str]:
    return frozenset(axis.name for axis in found.run.cell.axes)


def joined(evidence: list[Evidence], axes: frozenset[str]) -> list[Evidence]:
    """With one line for axes that say the same: `kingkong.1, kingkong.2: no TPDO for 3 ticks`."""
    lines: list[Evidence] = []
    heads: dict[tuple[str, str, str], int] = {}
    for fact in evidence:
        before, axis, after = _about(fact.text, axes)
        key = (fact.source, before, after)
        at = heads.get(key) if axis else None
        if at is not None and fact.log_time_ns - lines[at].log_time_ns <= TOGETHER_NS:
            first = lines[at]
            names = first.text[len(before) : len(first.text) - len(after)]
            lines[at] = replace(first, text=f"{before}{names}, {axis}{after}")
            continue
        heads[key] = len(lines)
        lines.append(fact)
    return lines


def _about(text: str, axes: frozenset[str]) -> tuple[str, str, str]:
    """Text before an axis' name, the name, and text after it; all of it before where there is none."""
    for word in text.split():
        name = word.rstrip(":")
        if name in axes:
            before, _, after = text.partition(name)
            return before, name, after
    return text, "", ""


def _fact(found: Findings, evidence: Evidence) -> EvidenceReview:
    return EvidenceReview(
        t_s=found.t_s(evidence.log_time_ns), source=evidence.source, text=evidence.text, tick=evidence.tick
    )


def lines(incident: WhyReview) -> Iterator[str]:
    """For people: the sentence, then who saw what, when."""
    yield f"{incident.t_s:10.3f} s  {incident.message}"
    facts = incident.evidence
    head = facts if len(facts) <= LINES_MAX else facts[: LINES_MAX // 2]
    tail = () if len(facts) <= LINES_MAX else facts[-LINES_MAX // 2 :]
    yield from map(_line, head)
    if tail:
        yield f"{'':>14}... {len(facts) - len(head) - len(tail)} more"
        yield from map(_line, tail)


def _line(fact: EvidenceReview) -> str:
    tick = "" if fact.tick is None else f" (tick {fact.tick})"
    return f"{fact.t_s:14.3f} s  {fact.source:<10} {fact.text}{tick}"
