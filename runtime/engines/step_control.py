"""Compute tolerances and first steps, and the array that passes them to a kernel."""

from __future__ import annotations

import math

import numpy as np

from synchain.codegen.driver.columns import Control
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.names import NodeName
from synchain.models.scenes.scene import Scene

from ..cells.plan import FIRST_STEP, Planner

GROWN = 0.1  # longest first step of a Rosenbrock method, relative to the time of growth by a factor e: a choice
# Numbers by which a kernel distinguishes the directions of a section.
DIRECTIONS = {"falling": -1.0, "rising": 1.0, "both": 0.0}


def control_array(
    rtol: float, atol: float, max_step: float, max_steps: float, direction: float = 0.0, jumps: bool = True
) -> np.ndarray:
    """Return the array (Control.FURTHER,) of a kernel's limits; without `jumps` no cell skips whole cycles."""
    control = np.zeros(Control.FURTHER)
    control[Control.RTOL], control[Control.ATOL] = rtol, atol
    control[Control.FIRST_STEP], control[Control.MAX_STEP] = FIRST_STEP, max_step
    control[Control.MAX_STEPS], control[Control.DIRECTION] = max_steps, direction
    control[Control.NO_JUMPS] = float(not jumps)
    return control


def control_of(planner: Planner, jumps: bool) -> np.ndarray:
    """Return the control array of a scene's sweep: tolerances of the strictest cell, a direction per section, sample times."""
    scene = planner.scene
    rtol, atol = (float(column.min()) for column in tolerances(scene, scene.equations, planner.extremes().numbers))
    directions = [DIRECTIONS[section.direction] for section in scene.sections.values() or (scene.section,)]
    control = control_array(rtol, atol, math.inf, scene.max_steps, directions[0], jumps)
    return np.concatenate([control, directions[1:], scene.t_eval])


def first_step(growth: float) -> float:
    """Return the first step of a Rosenbrock method, from the rate of growth of motions at the start."""
    # A step much longer than the time of growth damps fast growth like fast decay, and damps the error estimate too:
    # the motion would stay at an unstable equilibrium. A short first step, after which the steps lengthen, resolves the
    # growth.
    return min(FIRST_STEP, GROWN / max(growth, GROWN))


def tolerances(scene: Scene, equations: Equations, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (rtol, atol), each (cells,), of the integration."""
    # `parameters` (cells, count) are those of the equations. A smoothed jump of friction has the width 1/kappa in
    # velocity; steps that do not resolve this width miss the jump. With contact "atan", rtol is therefore at most
    # 1/kappa and atol at most 0.1/kappa (not below 1e-13), for the largest kappa of the nodes.
    rtol, atol = np.full(len(parameters), scene.rtol), np.full(len(parameters), scene.atol)
    columns = [k for k, name in enumerate(equations.parameters) if name.startswith("kappa")]
    if scene.contact != "atan" or not columns or not len(parameters):
        return rtol, atol
    # One kappa for all nodes, or kappa_1 … for each node, or kappa_1_2 … for each link.
    names = {"kappa"}
    if "kappa" in scene.varied:
        links = scene.model.link_names("kappa")
        names = {*map(str, links.values())} or {str(NodeName("kappa", i)) for i in scene.model.holders("kappa")}
    columns = [k for k in columns if equations.parameters[k] in names]
    if columns:
        width = 1.0 / np.maximum(parameters[:, columns].max(axis=1), 1e-300)
        rtol, atol = np.minimum(rtol, np.maximum(width, 1e-13)), np.minimum(atol, np.maximum(0.1 * width, 1e-13))
    return rtol, atol


def scale_of_atol(size: np.ndarray) -> np.ndarray:
    """Return the factor of the default atol for motions of these sizes: a power of ten, at most 1."""
    # The default atol is a tenth of rtol. For sizes below 0.1, the scaled atol is between 0.1 and 1 times rtol times
    # the size; it changes at 0.1, 0.01 and so on. Larger motions keep the default: for a motion of size 1e9, atol is
    # negligible beside rtol times the size, so that rtol alone controls the steps. A size of 0 means an unknown size.
    return np.asarray(10.0 ** np.floor(np.log10(np.where((size > 0.0) & (size < 0.1), 10.0 * size, 1.0))))
