"""Mutation testing of the symbolic core and of the code of thresholds:
`python tests/mutants.py [MODULE ...]`.

Operators are those of Cosmic Ray. Each mutant is tried in a fork of a process that has loaded the
third-party packages and nothing of ours, so that no cache of a right run hides it; its source
replaces the module's while it is imported, and no file is written. It meets the tests that ran its
statement, by coverage contexts, shortest first, until one fails. Results are added to
.mutants/results.jsonl; a mutant that is listed there is not tried again.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.machinery
import json
import os
import random
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(os.environ.get("SYNCHAIN_MUTANTS", ROOT / ".mutants"))
TESTS = {
    "models/algebra/cosines": "spectrum closed_forms angle_text graph_families",
    "models/graphs/closed_forms": "closed_forms spectrum",
    "models/spectra/joint": "joint",
    "models/mechanics/contact": "contact contact_theory",
    "models/interactions/coupling": "coupling_matrix parts_manual",
    "models/algebra/isolation": "isolation spectrum",
    "models/mechanics/lagrangian": "lagrangian nondimensional energy inertia",
    "models/interactions/link": "network inertia coupling_matrix lagrangian nondimensional",
    "models/dynamics/network": "network nondimensional inertia coupling_matrix",
    "models/mechanics/nondimensional": "nondimensional frictions lagrangian",
    "models/dynamics/saltation": "contact_theory contact_tangents",
    "models/algebra/equality": "separation symbolic_weights angle_text claims",
    "models/spectra/solve": "spectrum clusters jordan closed_forms angle_text",
    "models/dynamics/variational": "tangent coupling_matrix",
    "runtime/prediction/intervals": "intervals one_way",
    "runtime/synchronisation/probe": "probe",
    "runtime/prediction/stable_ranges": "synchronisability",
    "runtime/prediction/synchronisability": "synchronisability one_way",
    "runtime/synchronisation/threshold": "threshold one_way synchronisability",
    "runtime/prediction/mode_windows": "tangent synchronisability",
}
"""The test files that concern a module."""
COMPARISONS = ["Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is"]
BINARY = ["Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_FloorDiv", "Pow_Mul"]
BITS = ["BitOr_BitAnd", "BitAnd_BitOr"]
UNARY = ["Delete_USub", "Delete_Not", "Delete_Invert"]
OPERATORS = [
    *(f"ReplaceComparisonOperator_{name}" for name in COMPARISONS),
    *(f"ReplaceBinaryOperator_{name}" for name in BINARY + BITS),
    *(f"ReplaceUnaryOperator_{name}" for name in UNARY),
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd", "AddNot"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ExceptionReplacer", "ZeroIterationForLoop"),
    "NumberReplacer",
]
"""Of the operators that put something in the same place the one whose result is hardest to tell
from the right one.
"""
PRELOADED = "sympy flint mpmath numpy scipy.stats scipy.integrate scipy.io numba xarray tqdm networkx hypothesis pytest"


def spans(tree: ast.AST) -> tuple[list[tuple[int, int]], list[tuple[tuple[int, int], tuple[int, int]]]]:
    """Lines of the statements (of compound ones the head), and places of annotations, which no run
    looks at.
    """
    lines, annotations = [], []
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = body[0].lineno - 1 if body else node.end_lineno
            lines.append((node.lineno, max(last, node.lineno)))
        for name in ("annotation", "returns"):
            part = getattr(node, name, None)
            if part is not None:
                annotations.append(((part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)))
    return lines, annotations


def mutants(module: str) -> Iterator[dict[str, Any]]:
    """Every mutant of a module: its operator, occurrence, line, and the lines of its statement."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator

    source = (ROOT / f"{module}.py").read_text(encoding="utf-8")
    lines, annotations = spans(ast.parse(source))
    nodes = list(ast_nodes(get_ast(source)))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        places = [start for node in nodes for start, _ in operator.mutation_positions(node)]
        for occurrence, start in enumerate(places):
            if any(first <= start < last for first, last in annotations):
                continue
            statement = max((s for s in lines if s[0] <= start[0] <= s[1]), default=(start[0], start[0]))
            old = source.splitlines()[start[0] - 1].strip()
            yield {
                "key": f"{module} {name} {occurrence} {old}",
                "module": module,
                "line": start[0],
                "operator": name,
                "occurrence": occurrence,
                "old": old,
                "statement": statement,
            }


def mutated(mutant: dict[str, Any]) -> str:
    """The source of the module with the mutation."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    source = (ROOT / f"{mutant['module']}.py").read_text(encoding="utf-8")
    return mutate_code(source, get_operator(f"core/{mutant['operator']}")(), mutant["occurrence"])


class Durations:
    """A pytest plugin that notes how long each test takes, in seconds."""

    def __init__(self) -> None:
        self.found: dict[str, float] = {}

    def pytest_runtest_logreport(self, report: Any) -> None:
        self.found[report.nodeid] = self.found.get(report.nodeid, 0.0) + report.duration


class Chosen:
    """A pytest plugin that runs only the listed tests, in their order."""

    def __init__(self, tests: list[str]) -> None:
        self.order = {name: k for k, name in enumerate(tests)}

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        items[:] = sorted((i for i in items if i.nodeid in self.order), key=lambda i: self.order[i.nodeid])


def baseline(name: str) -> tuple[Path, dict[str, float]]:
    """Coverage with contexts and durations of one test file, run once in a process of its own."""
    data, times = FOLDER / f".coverage.{name}", FOLDER / f"{name}.json"
    if not times.exists():
        FOLDER.mkdir(exist_ok=True)
        (path,) = (ROOT / "tests").rglob(f"test_{name}.py")
        code = (
            "import json, pytest, sys; from mutants import Durations; d = Durations(); "
            f"r = pytest.main([{str(path)!r}, '-q', '--cov', '--cov-context=test', '--cov-report='], [d]); "
            f"r or open({str(times)!r}, 'w').write(json.dumps(d.found)); sys.exit(r)"
        )
        environment = {**os.environ, "COVERAGE_FILE": str(data), "PYTHONPATH": str(ROOT / "tests")}
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, check=True)
    return data, json.loads(times.read_text())


def reached(module: str) -> tuple[dict[int, set[str]], dict[str, float]]:
    """For every line of a module the tests that run it, and the seconds that these take; '' runs
    while it is imported.
    """
    import coverage

    lines: dict[int, set[str]] = {}
    seconds: dict[str, float] = {}
    for name in TESTS[module].split():
        data, times = baseline(name)
        found = coverage.CoverageData(str(data))
        found.read()
        for path in found.measured_files():
            if path.endswith(f"/{module}.py"):
                for line, contexts in found.contexts_by_lineno(path).items():
                    lines.setdefault(line, set()).update(c.partition("|")[0] for c in contexts)
        seconds |= times
    return lines, seconds


def chosen(mutant: dict[str, Any], lines: dict[int, set[str]], seconds: dict[str, float], limit: float) -> list[str]:
    """The tests that a mutant meets, shortest first, of `limit` seconds in all; none where no test
    runs its statement.
    """
    first, last = mutant["statement"]
    contexts = set().union(*(lines.get(k, set()) for k in range(first, last + 1)))
    if "" in contexts:  # run on import: whatever uses the module may see it
        contexts = set().union(*lines.values())
    tests, total = [], 0.0
    for name in sorted(contexts - {""}, key=lambda t: (seconds.get(t, 0.0), t)):
        total += seconds.get(name, 0.0)
        if tests and total > limit:
            break
        tests.append(name)
    return tests


def attempt(mutant: dict[str, Any], tests: list[str], cpu: int) -> str:
    """Fork, put the mutant in the place of its module, and run tests: killed, survived or timeout."""
    source = mutated(mutant)
    mutant["new"] = source.splitlines()[mutant["line"] - 1].strip()
    child = os.fork()
    if child == 0:
        code = 9
        try:
            code = _run(mutant["module"], source, tests, cpu)
        finally:
            os._exit(code)
    status = os.waitpid(child, 0)[1]
    if os.WIFSIGNALED(status):
        return "timeout"
    code = os.WEXITSTATUS(status)
    if code in (5, 9):
        raise RuntimeError(f"exit code {code} of {mutant['key']}; expected that the tests are found and run")
    return "survived" if code == 0 else "killed"


def _run(module: str, source: str, tests: list[str], cpu: int) -> int:
    import pytest

    resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))
    output = os.open(os.devnull if not os.environ.get("SHOW") else "/dev/stderr", os.O_WRONLY)
    os.dup2(output, 1)
    os.dup2(output, 2)
    loader = importlib.machinery.SourceFileLoader
    original, name = loader.get_code, "synchain." + module.replace("/", ".")

    def get_code(self: Any, fullname: str) -> Any:
        return compile(source, self.path, "exec") if fullname == name else original(self, fullname)

    loader.get_code = get_code  # type: ignore[method-assign]
    files = sorted({test.partition("::")[0] for test in tests})
    return int(pytest.main([*files, "-x", "-q", "-p", "no:cacheprovider", "-p", "no:cov"], [Chosen(tests)]))


def drawn(mutant: dict[str, Any], share: float, seed: int) -> bool:
    """Whether a mutant belongs to the sample; a larger share of the same seed holds the smaller
    one.
    """
    return random.Random(f"{seed} {mutant['key']}").random() < share


def survey(module: str, given: argparse.Namespace) -> None:
    """Try the mutants of a module that were not tried before and write down what came of them."""
    results = FOLDER / "results.jsonl"
    known = {json.loads(line)["key"] for line in results.open()} if results.exists() else set()
    lines, seconds = reached(module)
    todo = [m for m in mutants(module) if m["key"] not in known and drawn(m, given.share, given.seed)]

    def one(mutant: dict[str, Any]) -> None:
        tests, start = chosen(mutant, lines, seconds, given.limit), time.monotonic()
        outcome = "no test" if not tests else attempt(mutant, tests, 10 + int(given.limit))
        row = mutant | {"outcome": outcome, "tests": len(tests), "seconds": round(time.monotonic() - start, 1)}
        with results.open("a") as file:
            file.write(json.dumps(row) + "\n")
        if outcome in ("survived", "no test"):
            print(
                f"{outcome}: {module}.py:{mutant['line']}  {mutant['old']}\n      ->  {mutant.get('new')}", flush=True
            )

    with ThreadPoolExecutor(given.jobs) as pool:
        list(pool.map(one, todo))


def table(modules: list[str]) -> None:
    """Print how many mutants of each module were killed."""
    rows = [json.loads(line) for line in (FOLDER / "results.jsonl").open()]
    print("| module | mutants | killed | in time | survived | no test |\n|---|---|---|---|---|---|")
    for module in modules:
        found = [row["outcome"] for row in rows if row["module"] == module]
        counts = [found.count(name) for name in ("killed", "timeout", "survived", "no test")]
        print(f"| {module} | {len(found)} | {' | '.join(map(str, counts))} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", default=sorted(TESTS), help="such as models/spectra/solve")
    parser.add_argument("--limit", type=float, default=30.0, help="seconds of tests that a mutant meets (default: 30)")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    parser.add_argument("--share", type=float, default=1.0, help="part of the mutants that is drawn (default: 1)")
    parser.add_argument("--seed", type=int, default=1, help="seed of that draw (default: 1)")
    parser.add_argument("--count", action="store_true", help="print the number of mutants and stop")
    given = parser.parse_args()
    if given.count:
        for module in given.modules:
            print(module, sum(1 for _ in mutants(module)))
        return
    os.chdir(ROOT)
    for name in PRELOADED.split():
        importlib.import_module(name)
    for module in given.modules:
        survey(module, given)
    table(given.modules)


if __name__ == "__main__":
    main()
