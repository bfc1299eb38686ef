"""Excitable or oscillating nerve membrane; x is its voltage, y its recovery.

FitzHugh and Nagumo's model, in FitzHugh's form.
"""

from ..definitions.inline import Field
from ..mechanics.parameter import Parameter

OSCILLATOR = Field(
    {"x": "c*(y + x - x**3/3 + current)", "y": "-(x - a + b*y)/c"},
    parameters={
        "a": Parameter(0.7, "1", "shift of the recovery"),
        "b": Parameter(0.8, "1", "decay of the recovery"),
        "c": Parameter(3.0, "1", "root of the ratio of the time scales of recovery and voltage", positive=True),
        "current": Parameter(-0.4, "1", "stimulus, FitzHugh's z: at rest for 0, oscillating near -0.4"),
    },
    initial={"x": 1.0},
    source="FitzHugh, Biophys. J. 1, 445 (1961), eqs. 1 and 2; Nagumo, Arimoto & Yoshizawa, Proc. IRE 50, 2061 (1962)",
)
