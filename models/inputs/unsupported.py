"""Keyword -> feature in the literature that this program lacks, or writes in another way."""

from __future__ import annotations

from collections.abc import Mapping

_DELAYS = "delays are not supported; JiTCDDE and DifferentialEquations.jl (DDEProblem) integrate them"
_NOISE = "noise is not supported; JiTCSDE and DifferentialEquations.jl (SDEProblem) integrate it"
_RESETS = "resets are events of an oscillator; write Field(…, events=[Reset(guard, {state: value})])"
_CONSTRAINTS = "constraints are not supported; take coordinates without them, or a solver of DAEs such as SUNDIALS IDA"
_TRIADS = (
    "links of three nodes are rates or potentials of `i, j, k, W = ends(node, 3)` on a graph of `graphs.triangles`"
)
_MAPS = "maps are not supported, time is continuous; DynamicalSystems.jl iterates them"
_SUMS = (
    "a function of the sum of inputs is not supported, what links add is summed; docs/links.md writes S(sum of W*x_j) "
    "as links W*S(u_j), or with a state for the sum"
)
COMPLEX = "complex states are not supported; write real and imaginary part as two states"

_WORDS: Mapping[str, str] = {
    **dict.fromkeys(("delay", "delays", "time_delay", "history"), _DELAYS),
    **dict.fromkeys(("noise", "noises", "noise_strength", "diffusion", "stochastic"), _NOISE),
    **dict.fromkeys(("reset", "resets", "callback", "callbacks"), _RESETS),
    **dict.fromkeys(("constraint", "constraints"), _CONSTRAINTS),
    **dict.fromkeys(("triad", "triads", "triangles", "hyperedges", "simplices", "higher_order"), _TRIADS),
    **dict.fromkeys(("map", "maps", "discrete"), _MAPS),
    **dict.fromkeys(("sum", "summed_input", "input_sum", "inputs", "activation"), _SUMS),
    **dict.fromkeys(("complex", "complex_states"), COMPLEX),
}


def unsupported(name: object) -> str:
    """Return the sentence on an unsupported feature with this keyword; "" for any other word."""
    return _WORDS.get(name, "") if isinstance(name, str) else ""
