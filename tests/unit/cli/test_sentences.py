import pytest

from axisync_cli import sentences
from axisync_client import LeaseLost, Refused, Unavailable
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.replies import MoveReply, StepReport


def refused(code: ErrorCode, message: str, **details: object) -> Refused:
    return Refused(ErrorBody(code=code, message=message, details=details))


@pytest.mark.parametrize(
    ("error", "group", "sentence"),
    [
        (
            refused(ErrorCode.NOT_ENABLED, "kingkong is disabled: enable it first", group="kingkong"),
            "both",
            "kingkong is disabled: run `axisync enable kingkong`",
        ),
        (refused(ErrorCode.NOT_ENABLED, "off"), "wukong", "wukong is disabled: run `axisync enable wukong`"),
        (
            refused(ErrorCode.FAULTED, "kingkong has a fault", group="kingkong"),
            None,
            "kingkong has a fault: run `axisync reset kingkong`, then `axisync enable kingkong`",
        ),
        (
            refused(ErrorCode.LEASE_HELD, "kingkong is held by ann", group="kingkong"),
            "all",
            "kingkong is held by ann: `axisync lease` shows the holders, --take takes over",
        ),
        (
            refused(ErrorCode.INVALID_REQUEST, "no group 'x'.", groups=["a", "all"]),
            "x",
            "no group 'x': the groups are a, all",
        ),
        (refused(ErrorCode.SOFT_LIMIT, "beyond the soft limit"), "kingkong", "beyond the soft limit"),
        (Unavailable("nobody answers", "is axisyncd running?"), None, "nobody answers: is axisyncd running?"),
        (
            LeaseLost("lost", "acquire it again"),
            "k",
            "lost: `axisync lease` shows the holders, `axisync state` what the move does, `axisync stop k` ends it",
        ),
    ],
)
def test_one_sentence_with_the_fix(error: Refused, group: str | None, sentence: str) -> None:
    assert sentences.of_error(error, group) == sentence


def test_the_bar_names_the_step() -> None:
    steps = tuple(StepReport(kind="dwell", begins_s=at, duration_s=1.0, limiting=None) for at in (0.0, 1.0, 3.0))
    reply = MoveReply(
        request_id="", now_s=0.0, move_id="m", group="k", duration_s=4.0, scalars=(), T=(), U=(), minimum_s=(),
        limiting=None, steps=steps,
    )  # fmt: skip
    said = [sentences.of_progress(reply, progress) for progress in (0.0, 0.3, 0.74, 0.75, 1.0)]
    assert said == [f"k step {number} of 3" for number in (1, 2, 2, 3, 3)]
    assert sentences.of_progress(reply.model_copy(update={"steps": ()}), 0.5) == "k"
