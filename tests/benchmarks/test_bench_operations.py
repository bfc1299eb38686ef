"""Operations are counted as they are written, elementary functions by their own text, and alike in
every benchmark.
"""

from __future__ import annotations

import inspect
import re

import pytest
from samples import source_of

from benchmarks import roofline, skip
from benchmarks.kit.operations import PRIMITIVE, Counter, operations
from synchain import Scene
from synchain.codegen.simd import elementary, lanes
from synchain.graphs import chain, ring
from synchain.runtime.engines.scene_kernels import kernel_source

TEXT = """
DENSE = False
WIDTH = 8

def inner(x, y):
    z = fma(x, y, 2.0*3.0)       # 2: a product of numbers costs nothing
    return z*z - sqrt(y), -z     # 3: the sign costs nothing

def step(t, h, y, p):
    a = load(y, 2*WIDTH + 1, WIDTH)          # 0: addresses are integers
    b, c = inner(a, h + t)                   # 1 + 5
    if DENSE:
        store(p, 3, b*c)                     # 0: left out
    else:
        store(p, 3, b/c)                     # 1
    mask = (b > c*c) & (a == 1.0)            # 1
    return select(mask, maximum(a, b), a) + absolute(b)   # 1
"""


def counter(text: str) -> Counter:
    counts = Counter()
    counts.read(text)
    return counts


def test_operations_counted_by_hand():
    assert counter(TEXT).count("inner") == 5
    assert counter(TEXT).count("step") == 9
    assert counter(TEXT.replace("DENSE = False", "DENSE = True")).count("step") == 9
    assert counter(TEXT.replace("b/c", "b/c + b*c")).count("step") == 11


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("for i in range(t):\n        h = h*h", "For cannot be counted"),
        ("h = h**2", "operator Pow cannot be counted"),
        ("h = unheard(h)", "'unheard' is in none of the texts"),
        ("h = np.sqrt(h)", r"np\.sqrt cannot be counted"),
        ("if t:\n        h = h*h", "condition t is no constant"),
    ],
)
def test_what_cannot_be_counted_is_refused(line, message):
    with pytest.raises(ValueError, match=message):
        counter(f"def step(t, h):\n    {line}\n    return h\n").count("step")


def test_every_lane_function_has_a_number():
    assert set(lanes.__all__) - {"Lane", "Mask", "native_width"} <= set(PRIMITIVE)


def test_elementary_functions_count_their_multiply_adds():
    """An elementary function is at least two operations for each fma that it writes."""
    counts = counter(inspect.getsource(elementary))
    for name in ("exp", "log", "atan", "cos"):
        written = len(re.findall(r"\b(?:fma|multiply_add)\(", inspect.getsource(getattr(elementary, name))))
        assert counts.count(name) >= 2 * written > 0


def test_an_elementary_function_costs_what_its_text_does_in_both_benchmarks():
    """tanh by hand: 9 additions, 3 products, 1 quotient, 2 fused multiply-adds, and what
    `_expm1_parts` does.
    """
    counts = counter(inspect.getsource(elementary))
    text = "def step(y, p):\n    return tanh(load(y, 0, 1))*load(y, 1, 1)\n"
    assert operations(source_of(text)) == 1 + counts.count("tanh")
    assert counts.count("tanh") == counts.count("_expm1_parts") + 9 + 3 + 1 + 2 * 2
    assert skip.operations is operations
    assert roofline.operations is operations


def test_kernels_with_loops_are_refused():
    with pytest.raises(ValueError, match="unrolled"):
        operations(source_of("def step(y, p):\n    return load(y, 0, 1)\n", looped=True))


@pytest.mark.parametrize("oscillator", ["friction", "duffing", "harmonic"])
@pytest.mark.parametrize("integrator", ["rodas5p", "dop853"])
def test_every_unrolled_kernel_can_be_counted(oscillator, integrator):
    """One more link of a ring than of a chain costs more, whatever the node."""
    counts = [
        operations(kernel_source(Scene(oscillator=oscillator, topology=graph, integrator=integrator), reduce=False))
        for graph in (chain(3), ring(3))
    ]
    assert 0 < counts[0] < counts[1]


def test_a_quick_run_of_the_skips_needs_three_kernels():
    """Two cases, and between them the whole network, the one without records and the merged one.

    The tighter tolerance of the last column needs no kernels of its own."""
    texts = set()
    for case in skip.CASES[: skip.QUICK]:
        for chosen in skip.scenes(case, quick=True):
            tight = chosen.scene.replace(rtol=1e-10)
            texts.add(kernel_source(chosen.scene, reduce=chosen).text)
            assert kernel_source(tight).integrator == kernel_source(chosen.scene).integrator
    assert len(texts) == 3
    assert len({case.name for case in skip.CASES}) == 9
