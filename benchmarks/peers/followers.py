"""Other programs that follow branches: what they need, and their way to each case of the benchmark."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from . import bifpy_branches, jaxcont_branches, xpplab_branches
from .peer import absence


@dataclass(frozen=True, slots=True)
class Follower:
    """A program, the package to install, its modules and external programs, and a function for each of its cases."""

    name: str
    package: str
    modules: tuple[str, ...]
    cases: Mapping[str, Callable[[], Mapping[str, Sequence[float]]]]
    programs: tuple[str, ...] = ()

    def absence(self) -> str:
        """Return why the program cannot run here; empty where it can."""
        return absence(self.package, self.modules, self.programs)


FOLLOWERS = (
    Follower(
        "AUTO-07p (bifpy)", "bifpy (its build needs gfortran)", ("bifpy",), bifpy_branches.CASES, programs=("gfortran",)
    ),
    Follower("AUTO of XPPAUT (xpplab)", "xpplab", ("xpplab",), xpplab_branches.CASES),
    Follower("JaxCont", "jaxcont", ("jax", "jaxcont"), jaxcont_branches.CASES),
)


def of(case: str) -> dict[str, Callable[[], Mapping[str, Sequence[float]]]]:
    """Return the functions of the programs that can run here and have the case."""
    return {each.name: each.cases[case] for each in FOLLOWERS if case in each.cases and not each.absence()}


def skipped() -> list[str]:
    """Return a line for each program that cannot run here, with the reason and what to install."""
    reasons = {each.name: each.absence() for each in FOLLOWERS}
    return [f"skipped: {name} ({reason})" for name, reason in reasons.items() if reason]
