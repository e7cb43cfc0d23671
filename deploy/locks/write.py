"""Writes runtime.txt and dev.txt: exact versions of what pyproject.toml needs, as installed beside this interpreter.

To move to newer versions: `.venv/bin/pip install --upgrade NAME...`, then `make locks`, then `make test`.
A lock holds names and versions only, no index address and no hashes, so that any mirror of the packages serves it.
"""

import argparse
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.markers import Marker, default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

BUILD = ("hatchling", "editables")
"""What `pip install --no-build-isolation -e .` needs itself."""
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
"""A package that any of these needs on Linux is in the lock."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--project", type=Path, default=Path(__file__).parents[2] / "pyproject.toml")
    parser.add_argument("--into", type=Path, default=Path(__file__).parent)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a lock is not what is needed")
    arguments = parser.parse_args()
    project = tomllib.loads(arguments.project.read_text())
    extras = project["project"]["optional-dependencies"]
    runtime = [*BUILD, *project["project"]["dependencies"], *extras["service"], *extras["dashboard"]]
    dev = [*runtime, *project["dependency-groups"]["dev"]]
    try:
        for name, roots in (("runtime.txt", runtime), ("dev.txt", dev)):
            text = "\n".join(closure([Requirement(root) for root in roots])) + "\n"
            path = arguments.into / name
            if not arguments.check:
                path.write_text(text)
            elif path.read_text() != text:
                print(f"{path} is not what pyproject.toml and this environment give: run `make locks`", file=sys.stderr)
                return 1
    except PackageNotFoundError as error:
        print(f"{error.name} is not installed beside {sys.executable}: install it, then lock", file=sys.stderr)
        return 1
    return 0


def closure(roots: list[Requirement]) -> list[str]:
    """`name==version` of the roots and of everything they need, sorted by name.

    Raises:
        PackageNotFoundError: a needed package is not installed.
        SystemExit: an installed version does not satisfy a requirement.
    """
    found: dict[str, str] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    todo = list(roots)
    while todo:
        requirement = todo.pop()
        name, extras = canonicalize_name(requirement.name), frozenset(requirement.extras)
        installed = distribution(name)
        if not requirement.specifier.contains(installed.version, prereleases=True):
            raise SystemExit(f"{name} {installed.version} is installed, but {requirement} is needed")
        found[name] = installed.version
        if (name, extras) not in seen:
            seen.add((name, extras))
            needs = [Requirement(text) for text in installed.requires or []]
            todo += [need for need in needs if _applies(need.marker, extras)]
    return [f"{name}=={version}" for name, version in sorted(found.items())]


def _applies(marker: Marker | None, extras: frozenset[str]) -> bool:
    if marker is None:
        return True
    base = {key: str(value) for key, value in default_environment().items()}
    return any(
        marker.evaluate({**base, "python_version": python, "python_full_version": f"{python}.0", "extra": extra})
        for python in PYTHONS
        for extra in (extras or {""})
    )


if __name__ == "__main__":
    sys.exit(main())
