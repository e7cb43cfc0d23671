"""What a review found, as `axisync review --json` prints it. Times `t_s` count from the first tick of the log."""

from typing import Literal

from axisync_schemas.base import Strict


class Problem(Strict):
    """Something that a good log does not have."""

    kind: Literal["limit", "gap", "grid", "skipped", "arrival", "damage", "plan", "empty"]
    message: str
    axis: str | None = None
    tick: int | None = None
    t_s: float | None = None


class FileReview(Strict):
    """One file; `complete` when it has its end."""

    path: str
    bytes: int
    complete: bool
    damage: str | None = None


class MoveReview(Strict):
    """One move as it was asked for and played.

    Attributes:
        status: succeeded, stopped, failed, held, or executing where the log ends first.
        played_s: from its first tick to its last; None where the log has no tick of it.
    """

    move_id: str | None
    plan_id: int
    group: str
    kind: str
    user: str | None
    status: str
    reason: str | None
    begin_s: float
    planned_s: float | None
    played_s: float | None
    first_tick: int | None
    last_tick: int | None
    limiting: str | None


class Use(Strict):
    """A peak, in SI units, and its share of the limit."""

    peak: float
    share: float


class AxisReview(Strict):
    """How far an axis went: peaks by differences of setpoints, and following errors (rad)."""

    axis: str
    velocity: Use
    acceleration: Use
    jerk: Use
    stop_acceleration: Use
    stop_jerk: Use
    following_error_peak: float
    following_error_rms: float
    following_error_share: float
    following_error_tick: int


class LatenessReview(Strict):
    """Wake-ups after their instant, us; skipped ticks are counted apart. Histogram: lower edges and counts."""

    ticks: int
    p50_us: float
    p99_us: float
    p999_us: float
    max_us: float
    max_tick: int
    skipped: int
    skipped_in_a_row: int
    edges_us: tuple[float, ...]
    counts: tuple[int, ...]


class GapReview(Strict):
    """Ticks first..last that no file has; `t_s` is where the gap begins, or when it was said."""

    first_tick: int
    last_tick: int
    t_s: float
    why: str


class IncidentReview(Strict):
    """A stop, fault or refusal, and its cause in one sentence; `axisync why` has the evidence."""

    kind: Literal["stop", "fault", "refusal", "process"]
    t_s: float
    tick: int | None
    group: str | None
    message: str


class EventReview(Strict):
    """One event."""

    t_s: float
    kind: str
    source: str
    severity: str
    group: str | None
    message: str


class BusReview(Strict):
    """A bus: the load that its cell file makes, worst-case stuffing included, and the highest that was logged."""

    bus: str
    planned_load: float | None
    logged_load: float | None


class Review(Strict):
    """All of it. `verdict` is one line; `good` is False where there is a problem."""

    good: bool
    verdict: str
    problems: tuple[Problem, ...]
    cell: str
    files: tuple[FileReview, ...]
    versions: dict[str, str]
    began: str | None
    duration_s: float
    ticks: int
    missing_ticks: int
    duplicate_ticks: int
    sessions: int
    period_s: float
    moves: tuple[MoveReview, ...]
    axes: tuple[AxisReview, ...]
    lateness: LatenessReview
    gaps: tuple[GapReview, ...]
    incidents: tuple[IncidentReview, ...]
    events: tuple[EventReview, ...]
    buses: tuple[BusReview, ...]
    notes: tuple[str, ...]
