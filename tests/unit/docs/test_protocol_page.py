"""docs/protocol.md has every verb, topic and code, and no other; its numbers are those of the code."""

import re

from axisync_schemas import keys, topics
from axisync_schemas.commands import MAX_REQUEST_BYTES
from axisync_schemas.errors import ErrorCode
from axisync_schemas.export import MODELS
from axisync_service.actioner import idempotency, moves, requests
from axisync_service.actioner.rate import RATE_HZ
from axisync_service.hmi.recent import KEPT
from axisync_service.motion_controller.groups import ENABLE_TIMEOUT_NS, RESET_TIMEOUT_NS
from support.documents import ROOT

PAGE = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
NAMES = {model.__name__ for model in MODELS}


def rows(section: str) -> list[list[str]]:
    """Cells of the table of a section, without its head; without back ticks."""
    text = re.split(r"^## ", PAGE.split(f"\n## {section}\n")[1], flags=re.MULTILINE)[0]
    lines = [line for line in text.splitlines() if line.startswith("|")][2:]
    return [[cell.strip().replace("`", "") for cell in line.strip("|").split("|")] for line in lines]


def test_every_verb_with_its_request() -> None:
    found = {row[0]: row[1] for row in rows("Commands")}
    assert found == {verb: model.__name__ for verb, model in requests.MODELS.items()}
    assert found.keys() == set(keys.VERBS)


def test_every_model_is_offered_as_a_schema() -> None:
    named = {name for row in rows("Commands") for name in row[1:3]} | {row[1] for row in rows("Queries")}
    assert named - {"JSON Schema"} <= NAMES
    assert {model.__name__ for model in requests.MODELS.values()} <= NAMES


def test_every_topic_with_what_it_carries() -> None:
    found = {row[0]: (row[1].split(",")[0], row[2]) for row in rows("Streams")}
    rates = {topic.name: f"{topic.rate_hz:g}" if topic.rate_hz else "as they come" for topic in topics.PUBLISHED}
    assert found == {topic.name: (topic.schema, rates[topic.name]) for topic in topics.PUBLISHED}
    assert f"axisync/<cell>/{topics.ALIVE}" in PAGE


def test_every_code() -> None:
    assert [row[0] for row in rows("Errors")] == [str(code) for code in ErrorCode]


def test_numbers() -> None:
    assert f"at most {MAX_REQUEST_BYTES // 1024} KiB for a request" in PAGE
    kept = f"({idempotency.KEEP_AT_MOST:,} answers, {idempotency.KEEP_BYTES >> 20} MiB)"
    assert idempotency.KEEP_NS == 600e9
    assert f"within ten minutes {kept}" in PAGE.replace("\n", " ")
    assert f"over {RATE_HZ:.0f} requests a second" in PAGE
    assert f"the newest {moves.KEEP_AT_MOST:,} are known" in PAGE
    assert f"the newest {KEPT}" in PAGE
    assert ENABLE_TIMEOUT_NS == RESET_TIMEOUT_NS == 3e9
