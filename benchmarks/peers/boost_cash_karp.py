"""The source paper's own method: Cash-Karp 5(4) of Boost Odeint, in C++ compiled at -O3
-march=native.

The paper's tolerances, 1e-15 absolute and 1e-12 relative, are the last pair. Without a C++ compiler
or Boost, the rows of the same method through this program's own kernels stand for it.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from string import Template

import numpy as np
import sympy as sp

from .problem import Problem, Solve

SOURCE = Template("""
#include <array>
#include <cmath>
#include <boost/numeric/odeint.hpp>

using State = std::array<double, $size>;

static void rhs(const State &y, State &out, double t) {
    $rhs
}

extern "C" int solve(double rtol, double atol, const double *y0, const double *times, int count, double *states) {
    using namespace boost::numeric::odeint;
    State y;
    for (int i = 0; i < $size; ++i) y[i] = y0[i];
    auto stepper = make_controlled(atol, rtol, runge_kutta_cash_karp54<State>());
    double t = 0.0, h = 1e-4;
    try {
        for (int k = 0; k < count; ++k) {
            integrate_adaptive(stepper, rhs, y, t, times[k], h);
            t = times[k];
            for (int i = 0; i < $size; ++i) states[k * $size + i] = y[i];
        }
    } catch (const std::exception &) { return 1; }
    return 0;
}
""")


def fault() -> str:
    """Return why the headers cannot be used; empty where they can."""
    text = "#include <boost/numeric/odeint.hpp>\n"
    done = subprocess.run(
        ["g++", "-x", "c++", "-E", "-", "-o", "-"], input=text, capture_output=True, text=True, check=False
    )
    return "" if done.returncode == 0 else "no boost/numeric/odeint.hpp"


def prepare(problem: Problem) -> Solve:
    """Return a solver compiled in a temporary folder; RuntimeError with the compiler's words where
    that fails.
    """
    lines = problem.statements(problem.rhs(), "out[{}]", sp.ccode, "const double ")
    text = SOURCE.substitute(size=problem.equations.dimension, rhs=";\n    ".join(lines) + ";")
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "peer.cpp"), Path(folder, "peer.so")
        source.write_text(text, encoding="utf-8")
        command = ["g++", "-std=c++17", "-O3", "-march=native", "-shared", "-fPIC", str(source), "-o", str(library)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"g++ failed: {done.stderr.strip().splitlines()[:1]}")
        function = ctypes.CDLL(str(library)).solve
    doubles = ctypes.POINTER(ctypes.c_double)
    function.argtypes = [ctypes.c_double, ctypes.c_double, doubles, doubles, ctypes.c_int, doubles]

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ends, start = np.ascontiguousarray(times, dtype=float), problem.y0
        states = np.empty((len(ends), len(start)))
        arrays = (start.ctypes.data_as(doubles), ends.ctypes.data_as(doubles))
        if function(rtol, atol, *arrays, len(ends), states.ctypes.data_as(doubles)) != 0:
            raise RuntimeError(f"Boost Odeint gave up at rtol = {rtol:g}")
        return states

    return solve
