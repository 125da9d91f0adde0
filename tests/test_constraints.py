"""constraints.txt has one version of each required package, and pyproject.toml allows it."""

from __future__ import annotations

from importlib.metadata import requires
from typing import TYPE_CHECKING

import pytest
from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.constraints import EXTRAS, FILE, pins

if TYPE_CHECKING:
    from collections.abc import Iterator

PINS = pins(FILE.read_text("utf-8"))


def requirements(extras: set[str], environment: dict[str, str]) -> Iterator[Requirement]:
    """Yield what is required there, with the extras that an extra names."""
    for requirement in map(Requirement, requires("tfcompose") or ()):
        marker = requirement.marker
        if marker and not any(
            marker.evaluate(environment | {"extra": extra}) for extra in ("", *extras)
        ):
            continue
        if requirement.name == "tfcompose":
            yield from requirements(requirement.extras, environment)
        else:
            yield requirement


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
@pytest.mark.parametrize("python", ["3.10", "3.11", "3.12", "3.13", "3.14"])
def test_every_package_that_is_required_has_one_version_and_it_is_allowed(
    python: str, machine: str
) -> None:
    environment = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "platform_machine": machine,
        "sys_platform": "linux",
    }
    required = list(requirements(set(EXTRAS), environment))
    assert {"pydantic", "numpy", "ruff"} <= {requirement.name for requirement in required}
    for requirement in required:
        versions = [
            version
            for name, version, marker in PINS
            if name == canonicalize_name(requirement.name)
            and (not marker or Marker(marker).evaluate(environment))
        ]
        allowed = list(requirement.specifier.filter(versions))
        assert (len(versions), allowed) == (1, versions), f"{requirement}: {versions}"


def test_a_line_is_a_name_with_a_version() -> None:
    names = [(name, version) for name, version, _ in PINS]
    assert len(names) == len(set(names))
    for line in (
        "numpy",
        "numpy>=2",
        "numpy @ https://example.org/numpy.whl",
        "-i https://example.org",
        "numpy==2 --hash=x",
    ):
        with pytest.raises(ValueError, match="no name with a version"):
            pins(f"# A comment.\nscipy==1.15.3 ; python_full_version < '3.11'\n{line}\n")
