"""The text of kernels: the same everywhere, what its header says, what it leaves out, and what is refused."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sympy as sp
from samples import CASES, TABLE, friction_chain, real

from synchain.codegen import simd
from synchain.codegen.integrators import integrator
from synchain.codegen.kernels.driver import RECORDERS, Driver, KernelKind, Recorder, imports
from synchain.codegen.kernels.mode_kernel import emit_modes
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.program.lowering import UnprintableError
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import write_looped, write_step
from synchain.graphs import chain
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import mode
from synchain.models.mechanics.components import Node
from synchain.models.scenes.scene import Scene

V_1 = sp.Symbol("v_1", real=True)


def test_golden_kernels(golden):
    golden(
        "chain_2_rodas5p.txt",
        emit(friction_chain(2), "rodas5p", Recording(("sync_error", "section"), V_1), width=8).text,
    )
    golden("chain_1_dop853.txt", emit(friction_chain(1), "dop853", Recording(()), width=4).text)
    variation = mode(Scene(oscillator="duffing", topology=chain(2)).equations)
    golden("modes_taylor_6.txt", emit_modes(variation, integrator("taylor", 6), width=8).text)


DRIVERS = {
    "contacts": Driver(KernelKind.SWEEP, 8, contacts=True),
    "looped": Driver(KernelKind.SWEEP, 8, looped=True),
    "series": Driver(KernelKind.SWEEP, 8, series=True),
    "frame": Driver(KernelKind.FRAME, 8, looped=True, series=True),
    "modes": Driver(KernelKind.MODES, 8, contacts=True),
    "modes_series": Driver(KernelKind.MODES, 8, contacts=True, series=True),
} | {name: Recorder(name, 8, False) for name in RECORDERS}


@pytest.mark.parametrize("name", DRIVERS)
def test_golden_drivers(golden, name):
    golden(f"driver_{name}.txt", DRIVERS[name].text)


@pytest.mark.parametrize("name", DRIVERS)
def test_a_module_imports_what_its_code_names(name):
    """Words of its docstrings and comments bring nothing; attributes neither."""
    text = DRIVERS[name].text
    names_found = {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    imported = re.search(r"^from synchain.codegen.simd import (.*)$", text, re.MULTILINE)[1].split(", ")
    assert imported == sorted(names_found & set(simd.__all__))
    assert imports("import math\n'sin'; \"cos\"  # exp\n\"\"\"tan\nlog\"\"\"\nmath.sqrt(atan(1.0))").splitlines() == [
        "import math", "", "from synchain.codegen.simd import atan"
    ]  # fmt: skip


def test_scenes_of_the_same_kind_share_a_driver():
    few, many = (emit(friction_chain(n), "rodas5p", Recording(("section",), V_1), width=4) for n in (1, 5))
    other = emit(
        CASES["tanh pair"],
        "cash_karp",
        Recording(("section",), sp.Symbol(CASES["tanh pair"].state[0], real=True)),
        width=4,
    )
    assert few.driver == many.driver == other.driver
    assert few.dimensions != many.dimensions
    ways = {
        few.driver,
        emit(friction_chain(1), "rodas5p", Recording(()), width=4).driver,
        emit(friction_chain(1), "rodas5p", Recording(("section",), V_1), width=8).driver,
        emit(friction_chain(2), "rodas5p", Recording(("section",), V_1), width=4, unroll=0).driver,
    }
    assert few.recorders == other.recorders == (Recorder("cut", 4, False),)
    assert len({driver.text for driver in ways}) == 3


def written() -> str:
    """Texts of kernels, drivers and Taylor steps."""
    texts = []
    for eq in (CASES["looped"], CASES["friction 3"]):
        section = sp.Symbol(eq.state[-1], real=True) - sp.Rational(1, 3)
        for method in ("cash_karp", "rodas5p"):
            source = emit(eq, method, Recording(("section", "trajectory"), section), width=2)
            texts += [source.text, source.driver.text]
    smooth = tidy(CASES["looped"])
    return "\n".join([*texts, write_step(smooth, 8).text, write_looped(smooth, 8).text])


def test_text_does_not_depend_on_the_hash_seed():
    program = "import sys; sys.path[:0] = sys.argv[1:]; from test_kernel_text import written; print(written())"
    here = Path(__file__).parent
    texts = subprocess.run(
        [sys.executable, "-c", program, str(here), str(here.parents[1])], env={**os.environ, "PYTHONHASHSEED": "4711"},
        capture_output=True, text=True, check=True, timeout=120,
    ).stdout  # fmt: skip
    assert len(texts) > 100_000
    assert "# order 8" in texts
    assert texts == written() + "\n"


def test_the_header_says_what_runs():
    source = emit(friction_chain(2), "rodas5p", Recording(("section", "sync_error"), V_1))
    head = source.text.split('"""')[1]
    assert "2 oscillators, 2 links, rodas5p" in head
    assert source.equations.digest[:16] in head
    assert "State       x_1, x_2, v_1, v_2\n" in head
    assert f"Parameters  {', '.join(TABLE)}\n" in head
    assert "Records     final state, sync_error, section\n" in head
    assert "BIT Numerical Mathematics 63, 27 (2023)" in head


def test_records_that_are_not_wanted_cost_nothing():
    source = emit(friction_chain(1), "cash_karp", Recording(()), width=4)
    assert source.recorders == ()
    for record, name in (("sync_error", "observe"), ("section", "cut"), ("trajectory", "sample")):
        wanted = emit(friction_chain(1), "cash_karp", Recording((record,), V_1), width=4)
        assert wanted.recorders == (Recorder(name, 4, False),)
        assert wanted.driver == source.driver
    assert "\nDENSE = False\n" in source.text
    assert "def section(" not in source.text
    assert "def section(" in emit(friction_chain(1), "cash_karp", Recording(("section",), V_1), width=4).text
    assert "\nDENSE = True\n" in emit(friction_chain(1), "cash_karp", Recording(("trajectory",)), width=4).text


def test_unforced_equations_have_no_time_terms():
    x, v = real("x", "v")
    text = emit(Equations.of_equal_nodes(Node((x, v), (v, -sp.sin(x)), ()), None, 1), "rodas5p").text.split("def step")[
        1
    ]
    assert "cos(t" not in text
    assert "*h*w" not in text


def test_slopes_without_state_are_lanes():
    # where all stages were plain numbers, the functions of lanes would refuse them
    for method in ("cash_karp", "dop853"):
        assert "k1_phase_1 = broadcast(1.0, WIDTH)" in emit(CASES["tanh pair"], method).text


# -- refusals ------------------------------------------------------------------------------------------------


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match=r"unknown record 'sync'; known: sync_error, section, trajectory"):
        emit(friction_chain(1), "rodas5p", Recording(("sync",)))
    with pytest.raises(
        ValueError,
        match=r"unknown integrator 'rk4'; known: cash_karp, dop853, rodas4, rodas5p, rodas6p, ros34pw2, taylor",
    ):
        emit(friction_chain(1), "rk4")


def test_sections_are_checked():
    with pytest.raises(ValueError, match="record 'section' needs a section function, for example v_1"):
        emit(friction_chain(1), "rodas5p", Recording(("section",)))
    with pytest.raises(
        ValueError, match=r"section function v_2: unknown symbol 'v_2'; use the state, parameters and t"
    ):
        emit(friction_chain(1), "rodas5p", Recording(("section",), sp.Symbol("v_2", real=True)))
    with pytest.raises(UnprintableError, match="floating-point number"):
        emit(friction_chain(1), "rodas5p", Recording(("section",), V_1 - sp.Float(0.5)))


def test_what_cannot_be_printed_is_refused():
    x = real("x")[0]
    with pytest.raises(UnprintableError, match="no printing rule for gamma"):
        emit(Equations.of_equal_nodes(Node((x,), (sp.gamma(x),), ()), None, 1))


def test_the_head_of_a_kernel_names_the_states_that_are_called_otherwise():
    for n in (2, 9):
        head = emit(Scene(oscillator="lorenz", topology=chain(n), coupling="x->x").equations).text.split("import math")[
            0
        ]
        (line,) = (row for row in head.splitlines() if row.startswith("Renamed"))
        assert line == "Renamed     " + ", ".join(f"y_{i + 1} as y__{i + 1}" for i in range(n))
