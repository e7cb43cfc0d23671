import pytest

from axisync_cli.options import hoist


@pytest.mark.parametrize(
    ("words", "hoisted"),
    [
        (["state", "--endpoint", "a:1", "--json"], ["--endpoint", "a:1", "state", "--json"]),
        (["state", "--cell=eod"], ["--cell=eod", "state"]),
        (["--user", "ann", "move", "k", "--joint", "-1,2"], ["--user", "ann", "move", "k", "--joint", "-1,2"]),
        (["state", "--timeout"], ["state", "--timeout"]),
        (["enable", "--", "--cell", "x"], ["enable", "--", "--cell", "x"]),
        ([], []),
    ],
)
def test_global_options_may_stand_anywhere(words: list[str], hoisted: list[str]) -> None:
    assert hoist(words) == hoisted
