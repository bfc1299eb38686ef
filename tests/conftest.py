"""Options and fixtures of the tests: golden files are compared, or written anew with --update."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("synchain", deadline=None)  # a machine under load is no failure
settings.load_profile("synchain")

GOLDEN = Path(__file__).parent / "golden"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="write the golden files anew instead of comparing")
    parser.addoption("--long", action="store_true", help="run the modules that take minutes as well")


@pytest.fixture(autouse=True)
def no_figures_are_left() -> Iterator[None]:
    """Plots draw into pyplot's current axes: those of one test are none of the next."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def pytest_collection_finish() -> None:
    """Look for garbage less often, and never among modules and tests, which stay to the end."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


def pytest_sessionfinish() -> None:
    """Leave all to the end of the process: pytest would look for garbage among it twice."""
    gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what takes minutes, unless it was asked for or named."""
    if config.getoption("--long") or any(".py" in argument for argument in config.args):
        return
    long = [item for item in items if item.get_closest_marker("long")]
    if long:
        config.hook.pytest_deselected(items=long)
        items[:] = [item for item in items if item not in long]


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """A function of (file name, text) that fails where the text differs from the golden file of that name."""

    def check(name: str, text: str) -> None:
        path = GOLDEN / name
        if request.config.getoption("--update"):
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
        if not path.is_file():
            pytest.fail(f"no golden file {name}; write it with: pytest --update")
        assert text.splitlines() == path.read_text(encoding="utf-8").splitlines(), (
            f"{name} changed; look at the difference, then run: pytest --update"
        )

    return check
