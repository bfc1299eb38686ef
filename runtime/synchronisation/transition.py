"""Predict the sequence of clusters on the way to synchrony, and compare it with the stability of these clusters.

Two nodes are equal where all modes that separate them decay. A mode of eigenvalue gamma decays where sigma |gamma| lies
in a stable range of the master stability function. Which modes separate two nodes is decided exactly (`mode_classes`).
The prediction takes the exponents along the synchronous motion also where only some nodes are synchronous, which is an
approximation. `Transition.verify` computes exponents of each cluster state along its own motion instead.

Source: Bayani, Nazarimehr, Jafari, Kovalenko, Contreras-Aso, Alfaro-Bittner, Sánchez-García & Boccaletti, Nat. Commun.
15, 4955 (2024).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from synchain.codegen.kernels.mode_kernel import LARGEST_ORBIT
from synchain.models.graphs.topology import Topology
from synchain.models.inputs.checks import check_number, check_seed
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.spectra.eigenvalue import Eigenvalue
from synchain.models.symmetries.mode_classes import mode_classes, together
from synchain.models.symmetries.partitions import class_links

from ..cells.run_keywords import ORBITS, Given, chosen
from ..prediction.synchronisability import expect_no_repulsion
from ..results.labelled import Labelled, dataset, scene_text
from ..stability.averages import Averaging, document_keywords
from ..stability.cluster_exponents import ClusterExponents, cluster_exponents
from ..stability.exponents import initial_states
from ..stability.msf import MSF, on_a_line
from ..stability.transversal_modes import unused_axes
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook

SHORT = 16
"""Most letters of an exact eigenvalue in a summary; a longer one is written as a decimal number (a choice)."""

LISTED = 12
"""Most nodes of a cluster that a summary lists; of more, it writes their number (a choice)."""


@dataclass(frozen=True, slots=True)
class TransitionStep:
    """A coupling strength at which clusters form or dissolve.

    Parameters
    ----------
    strength : float
        Coupling strength alpha/abs(gamma), where alpha is an end of a stable range.
    error : float
        Uncertainty of the strength, from that of alpha. All steps of one alpha are shifted together.
    eigenvalue : Eigenvalue
        The exact eigenvalue gamma of the mode that changes its stability.
    before, classes : tuple of int
        The cluster of each node below and above the strength; clusters are numbered by their first nodes.
    imbalance : str
        Empty if the coarser of both states is a balanced partition. Else two nodes of one cluster feel different sums
        of weights: they are equal to first order in the unstable modes, and cannot be equal exactly.
    """

    strength: float
    error: float
    eigenvalue: Eigenvalue
    before: tuple[int, ...]
    classes: tuple[int, ...]
    imbalance: str = ""

    @property
    def joins(self) -> bool:
        """True if clusters form with increasing strength, False if they dissolve."""
        return max(self.classes) < max(self.before)

    @property
    def state(self) -> tuple[int, ...]:
        """The coarser of the states on both sides, whose stability changes."""
        return self.classes if self.joins else self.before

    @property
    def clusters(self) -> tuple[tuple[int, ...], ...]:
        """Nodes of each cluster that forms or dissolves, counted from 0."""
        finer = set(members(self.before if self.joins else self.classes))
        return tuple(nodes for nodes in members(self.state) if nodes not in finer)


@dataclass(frozen=True, slots=True, repr=False)
class Transition(Labelled):
    """Sequence of clusters on the way to synchrony, from small to large coupling strength.

    Parameters
    ----------
    function : MSF
        Master stability function of the scene, whose stable ranges determine the strengths.

    See Also
    --------
    synchain.transition
    """

    function: MSF

    @property
    def scene(self) -> Scene:
        """The scene with the network."""
        return self.function.scene

    @property
    def first(self) -> tuple[int, ...]:
        """The cluster of each node at strengths just above 0."""
        return self._sequence[0]

    @property
    def steps(self) -> tuple[TransitionStep, ...]:
        """The steps at which clusters form or dissolve, by increasing strength."""
        return self._sequence[1]

    @property
    def highest(self) -> float:
        """Strength up to which the sequence is known: there the mode of largest abs(gamma) leaves the grid of alpha."""
        return float(self.function.fine.alpha[-1]) / max(abs(value) for value in self.scene.topology.spectrum.values)

    @property
    def _sequence(self) -> tuple[tuple[int, ...], tuple[TransitionStep, ...]]:
        """Return the clusters just above strength 0, and the steps."""
        graph, ranges, top = self.scene.topology, self.function.fine.ranges, float(self.function.fine.alpha[-1])
        modes = mode_classes(graph)
        # stability at alpha = 0 holds for modes of eigenvalue 0; just above 0, for all other modes
        at_zero = any(low <= 0.0 <= high for (low, _), (high, _) in ranges)
        from_zero = any(low <= 0.0 < high for (low, _), (high, _) in ranges)
        unstable = {
            (k, root.value)
            for k, mode in enumerate(modes)
            for root in mode.eigenvalues
            if not (from_zero if root.value else at_zero)
        }
        # every end of a range changes the stability of each mode once
        changes = sorted(
            (
                (alpha / abs(root.value), error / abs(root.value), k, root)
                for alpha, error in (end for both in ranges for end in both)
                if 0.0 < alpha < top
                for k, mode in enumerate(modes)
                for root in mode.eigenvalues
                if root.value
            ),
            key=lambda change: change[0],
        )

        def state() -> tuple[int, ...]:
            separating = {k for k, _ in unstable}
            return together(graph.n, (modes[k] for k in separating))

        first = before = state()
        steps: list[TransitionStep] = []
        for strength, error, k, root in changes:
            if strength > self.highest:
                break
            unstable ^= {(k, root.value)}
            if (classes := state()) != before:
                coarser = min(before, classes, key=max)
                steps.append(TransitionStep(strength, error, root, before, classes, _imbalance(graph, coarser)))
                before = classes
        return first, tuple(steps)

    @property
    def data(self) -> xr.Dataset:
        """Strengths, errors and eigenvalues over the steps, and the cluster of each node after each step."""
        steps, graph = self.steps, self.scene.topology
        return dataset(
            {
                "strength": (("step",), [step.strength for step in steps], "coupling strength of the step"),
                "error": (("step",), [step.error for step in steps], "uncertainty of the strength"),
                "eigenvalue": (("step",), [step.eigenvalue.value for step in steps], "eigenvalue of the mode"),
                "class": (
                    ("step", "node"),
                    np.reshape([step.classes for step in steps], (len(steps), graph.n)),
                    "cluster of each node after the step",
                ),
                "first": (("node",), list(self.first), "cluster of each node just above strength 0"),
            },
            {"node": list(graph.labels)},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, stable ranges, a line for each step, and where the grid ends."""
        scene, graph, steps = self.scene, self.scene.topology, self.steps
        rows = [("scene", scene_text(scene)), ("negative for alpha", self.function.fine.negative)]
        if max(self.first) < graph.n - 1:
            rows.append(("from 0", f"{_clusters_text(graph, members(self.first))} together"))
        rows += [(f"step {k}", f"{scene.strength} = {_step_text(graph, step)}") for k, step in enumerate(steps, 1)]
        if not steps:
            rows.append(("steps", "none"))
        last = steps[-1].classes if steps else self.first
        end = "all nodes together" if not any(last) else f"{max(last) + 1} clusters"
        rows.append(("known up to", f"{scene.strength} = {self.highest:.6g}, {end}; there the grid of alpha ends"))
        return tuple(rows)

    def verify(
        self,
        apart: float = 0.1,
        *,
        precision: float | None = None,
        periods: float = 5000,
        transient: float | None = None,
        rng: int | np.random.Generator | None = None,
        show_progress: bool | None = None,
        progress: Hook | None = None,
    ) -> TransitionCheck:
        """Compute exponents of the cluster states on both sides of each step.

        At a step the prediction claims that the coarser state changes its stability. Its exponents are computed along
        its own motion by `cluster_exponents`, at the strengths (1 - apart) and (1 + apart) times that of the step. If
        all nodes of the scene start alike, the clusters start at different states near the scene's.

        Parameters
        ----------
        apart : float
            Relative distance of both strengths from that of the step, between 0 and 1.
        precision, periods, transient, rng
            Average of the exponents, as for `cluster_exponents`.
        show_progress, progress
            As for `cluster_exponents`, with one bar for each average.

        Returns
        -------
        TransitionCheck

        Raises
        ------
        ValueError
            If `apart` is not between 0 and 1, and as in `cluster_exponents`.

        Examples
        --------
        >>> import synchain as sc
        >>> node = sc.Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
        >>> scene = sc.Scene(node, "x->x", sc.graphs.chain(2), parameters={"sigma": 5})
        >>> sc.transition(scene, periods=200).verify(0.2, periods=200).verdicts
        ('confirmed',)
        """
        if not 0.0 < check_number("apart", apart) < 1.0:
            raise ValueError(f"apart: found {apart:g}; expected a number between 0 and 1")
        scene, steps = _started_apart(self.scene, rng), self.steps
        exponent, stderr = np.full((2, len(steps), 2), np.nan)
        strength = np.outer([step.strength for step in steps], [1.0 - apart, 1.0 + apart])
        remarks = []
        for k, step in enumerate(steps):
            remarks.append(step.imbalance and f"no such state: {step.imbalance}")
            if max(step.state) >= LARGEST_ORBIT:
                remarks[-1] = f"{max(step.state) + 1} clusters; exponents are computed for at most {LARGEST_ORBIT}"
            if remarks[-1]:
                continue
            sides: list[ClusterExponents] = []
            for j in range(2):
                found = cluster_exponents(
                    scene,
                    step.state,
                    precision=precision,
                    periods=periods,
                    transient=transient,
                    rng=rng,
                    show_progress=show_progress,
                    progress=progress,
                    parameters={scene.strength: float(strength[k, j])},
                )
                sides.append(found)
                worst = int(np.argmax(found.exponent))
                exponent[k, j], stderr[k, j] = found.exponent[worst], found.stderr[worst]
            merged = [f"{a + 1} and {b + 1}" for a, b in {*sides[0].merged, *sides[1].merged}]
            if merged:
                remarks[-1] = f"clusters {', '.join(sorted(merged))} merged: the exponents are those of a coarser state"
        return TransitionCheck(self, strength, exponent, stderr, tuple(remarks))


@dataclass(frozen=True, slots=True, repr=False)
class TransitionCheck(Labelled):
    """Exponents of the cluster state of each step of a `Transition`, below and above the step.

    Parameters
    ----------
    transition : Transition
        The predicted sequence.
    strength : ndarray, shape (steps, 2)
        Coupling strengths below and above each step.
    exponent : ndarray, shape (steps, 2)
        Largest transversal exponent of the cluster state, per unit of non-dimensional time; NaN if it is not computed.
    stderr : ndarray, shape (steps, 2)
        Standard errors of `exponent`.
    remarks : tuple of str
        Why exponents of a step are not computed, or are those of another state; else empty.

    See Also
    --------
    synchain.transition
    """

    transition: Transition
    strength: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    remarks: tuple[str, ...]

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Comparison of each step with the exponents of its state on both sides.

        "confirmed" if the state changes its stability as predicted, "reversed" if it changes in the other direction,
        "stable on both sides", "unstable on both sides", "undecided within the errors" if the sign of an exponent is
        uncertain by two standard errors, or "not computed".
        """
        verdicts = []
        for step, exponent, error in zip(self.transition.steps, self.exponent, self.stderr, strict=True):
            below, above = exponent < 0.0
            if np.isnan(exponent).any():
                verdicts.append("not computed")
            elif np.any(np.abs(exponent) <= 2.0 * error):
                verdicts.append("undecided within the errors")
            elif below == above:
                verdicts.append(f"{'stable' if below else 'unstable'} on both sides")
            else:
                verdicts.append("confirmed" if above == step.joins else "reversed")
        return tuple(verdicts)

    @property
    def crossing(self) -> np.ndarray:
        """Strength (steps,) at which the exponent of the cluster state is zero on the line through both sides.

        NaN if both exponents have one sign. The curvature of the exponent between both sides is neglected.
        """
        below, above = self.exponent.T
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(below * above < 0.0, below / (below - above), np.nan)
        return np.asarray(self.strength[:, 0] + share * np.diff(self.strength, axis=1)[:, 0])

    @property
    def crossing_error(self) -> np.ndarray:
        """Standard error (steps,) of `crossing`, from the errors of both exponents."""
        width = np.diff(self.strength, axis=1)[:, 0]
        share = (self.crossing - self.strength[:, 0]) / width
        spread = np.hypot((1.0 - share) * self.stderr[:, 0], share * self.stderr[:, 1])
        return np.asarray(spread * width / np.abs(np.diff(self.exponent, axis=1)[:, 0]))

    @property
    def data(self) -> xr.Dataset:
        """Exponents and errors over the steps and both sides, and where the exponents pass zero."""
        return dataset(
            {
                "strength": (("step", "side"), self.strength, "coupling strength"),
                "exponent": (("step", "side"), self.exponent, "largest transversal exponent of the cluster state"),
                "stderr": (("step", "side"), self.stderr, "standard error of the exponent"),
                "crossing": (("step",), self.crossing, "strength at which the exponent is zero"),
                "crossing_error": (("step",), self.crossing_error, "standard error of the crossing"),
                "verdict": (("step",), list(self.verdicts), "comparison with the predicted step"),
            },
            {"side": ["below", "above"]},
            self.transition.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """A line for each step: verdict, exponents on both sides, and where the exponent passes zero."""
        rows = [("scene", scene_text(self.transition.scene))]
        name = self.transition.scene.strength
        for k, (step, verdict) in enumerate(zip(self.transition.steps, self.verdicts, strict=True)):
            text = f"predicted {name} = {with_error(step.strength, step.error)}: {verdict}"
            if np.isfinite(self.exponent[k]).all():
                sides = (
                    f"{with_error(e, d)} at {s:.4g}"
                    for e, d, s in zip(self.exponent[k], self.stderr[k], self.strength[k], strict=True)
                )
                text += f"; exponents {', '.join(sides)}"
            if np.isfinite(self.crossing[k]):
                text += f"; zero at {with_error(self.crossing[k], self.crossing_error[k])}"
            rows.append((f"step {k + 1}", text + (f"; {self.remarks[k]}" if self.remarks[k] else "")))
        return tuple(rows)


@document_keywords
def transition(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray | None = None,
    *,
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    starts: int = 4,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
    workers: int | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Transition:
    """Predict which clusters of nodes form on the way to synchrony, and at which coupling strengths.

    Two nodes are equal at strengths where all modes that separate them decay. Eigenvectors are compared exactly, for
    degenerate eigenvalues in the whole eigenspace. The strengths follow from the zeros of the master stability
    function along the synchronous motion; `Transition.verify` tests this approximation.

    Parameters
    ----------
    scene : Scene
        Network of equal nodes with one layer of links that vanish between equal states, and real eigenvalues.
    alpha : array_like, shape (m,), optional
        Increasing real strengths of a mode from 0 on, as for `msf`. The sequence is known up to the coupling strength
        at which the fastest mode leaves them. By default they cover all modes at the strengths that the scene sweeps,
        or up to twice the scene's strength.
    {orbits}
    {parameters}

    Returns
    -------
    Transition

    Raises
    ------
    ValueError
        If the network has no links, several layers, complex or positive eigenvalues, or more than 300 nodes; if the
        strengths do not begin at 0; and as in `msf`.
    FloatingPointError
        If an integration fails.

    See Also
    --------
    cluster_exponents : Computes the stability of one cluster state.
    clusters : Finds the blocks of a balanced partition.

    References
    ----------
    Bayani et al., Nat. Commun. 15, 4955 (2024).

    Examples
    --------
    >>> import synchain as sc
    >>> node = sc.Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
    >>> diamond = sc.graphs.from_edges([(1, 2), (1, 3), (2, 3), (2, 4), (3, 4)])
    >>> sequence = sc.transition(sc.Scene(node, "x->x", diamond, parameters={"sigma": 4}), periods=200)
    >>> [step.clusters for step in sequence.steps]
    [((1, 2),), ((0, 1, 2, 3),)]
    """
    given = Given(transition, parameters, more, ORBITS)
    given.expect_one_cell(check_scene(scene), unused_axes(scene))
    graph = scene.topology
    scene.equations.expect_pairs("transition")
    if len(scene.model.linked) != 1:
        raise ValueError(f"transition: found {len(scene.model.linked)} layers of links; expected one")
    for eigenvalue in graph.spectrum:
        if isinstance(eigenvalue.value, complex):
            raise ValueError(
                f"transition: {graph.name}({graph.n}) has the complex eigenvalue {eigenvalue.value:.6g}; expected real "
                "ones, as undirected links have"
            )
        expect_no_repulsion(graph, eigenvalue.value)
    mode_classes(graph)  # ValueError for too many nodes
    averaging = Averaging.for_scene(
        scene, precision, periods, transient, rng, Execution(workers, None, show_progress, progress)
    )
    function = on_a_line(given, scene, alpha, starts, rtol, averaging)
    if not function.alpha[0] <= 0.0 < function.alpha[-1]:
        raise ValueError(
            f"transition: found alpha from {function.alpha[0]:g} to {function.alpha[-1]:g}; expected strengths from 0 on"
        )
    return Transition(function)


def members(classes: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Return the nodes of each class of at least two nodes."""
    lists = [[i for i, k in enumerate(classes) if k == c] for c in range(max(classes) + 1)]
    return tuple(tuple(nodes) for nodes in lists if len(nodes) > 1)


def _clusters_text(graph: Topology, clusters: Sequence[Sequence[int]]) -> str:
    """Return clusters by the labels of their nodes, as "{7, 8, 9}; {1, 3}"."""
    if len(clusters) == 1 and len(clusters[0]) == graph.n:
        return f"all {graph.n} nodes"
    texts = []
    for nodes in clusters:
        labels = ", ".join(str(graph.labels[i]) for i in nodes[:LISTED])
        texts.append(f"{{{labels}}}" if len(nodes) <= LISTED else f"{{{labels} …}} ({len(nodes)} nodes)")
    return "; ".join(texts)


def _step_text(graph: Topology, step: TransitionStep) -> str:
    """Return strength, eigenvalue and clusters of a step."""
    gamma = step.eigenvalue.text if len(step.eigenvalue.text) <= SHORT else f"{step.eigenvalue.value:.6g}"
    verb = f"{'join' if step.joins else 'part'}{' to first order' if step.imbalance else ''}"
    return f"{with_error(step.strength, step.error)}, gamma = {gamma}: {_clusters_text(graph, step.clusters)} {verb}"


def _imbalance(graph: Topology, classes: Sequence[int]) -> str:
    """Return why a partition is not balanced; empty if it is."""
    try:
        class_links(graph.n, graph.links, classes)
    except ValueError as problem:
        return str(problem)
    return ""


def _started_apart(scene: Scene, rng: int | np.random.Generator | None) -> Scene:
    """Return a scene whose nodes start at different states; a scene with different states stays unchanged."""
    if any(len(set(values)) > 1 for values in scene.initial.values()):
        return scene
    seed = check_seed("transition: rng", chosen(scene, "rng", rng, 0))
    states = initial_states(scene, scene.n, seed)
    return scene.replace(initial={name: states[:, k].tolist() for k, name in enumerate(scene.initial)})
