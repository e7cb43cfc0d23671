"""The locks name exact versions of all that pyproject.toml asks for, and nothing of where they come from."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

REPOSITORY = Path(__file__).parents[3]
PIN = re.compile(r"([a-z0-9-]+)==([0-9][A-Za-z0-9.]*)\Z")


def pins(name: str) -> dict[str, str]:
    """name -> version, of every line of a lock."""
    lines = (REPOSITORY / "deploy" / "locks" / name).read_text().splitlines()
    matches = [(line, PIN.match(line)) for line in lines]
    assert [line for line, match in matches if match is None] == []
    return {match[1]: match[2] for _, match in matches if match}


def wanted(*, dev: bool) -> list[Requirement]:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"]
    texts = [*project["project"]["dependencies"], *extras["service"], *extras["dashboard"]]
    return [Requirement(text) for text in (*texts, *(project["dependency-groups"]["dev"] if dev else ()))]


@pytest.mark.parametrize(("name", "dev"), [("runtime.txt", False), ("dev.txt", True)])
def test_lock_satisfies_every_requirement(name: str, dev: bool) -> None:
    locked = pins(name)
    unmet = [
        str(requirement)
        for requirement in wanted(dev=dev)
        if not requirement.specifier.contains(locked.get(canonicalize_name(requirement.name), "0"), prereleases=True)
        or canonicalize_name(requirement.name) not in locked
    ]
    assert unmet == []


def test_both_locks_agree_and_hold_the_build_back_end() -> None:
    runtime, dev = pins("runtime.txt"), pins("dev.txt")
    assert runtime.items() <= dev.items()
    assert {"hatchling", "editables"} <= runtime.keys()
