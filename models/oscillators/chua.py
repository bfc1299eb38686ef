"""Electronic circuit with a piecewise linear resistor; x and y are voltages, z is the coil's current.

Chua's circuit, the double scroll. In Matsumoto's circuit the conductance is G = 0.7, C_1 = 1/9, C_2 = 1, L = 1/7, and the
resistor has the slopes -0.8 within and -0.5 beyond one volt. In units of C_2/G for the time, one volt and G times one volt
that is p = C_2/C_1 = 9, q = C_2/(L G^2) = 100/7, a = -0.8/G = -8/7 and b = -0.5/G = -5/7.
"""

from ..definitions.inline import Field
from ..mechanics.parameter import Parameter

OSCILLATOR = Field(
    {
        "x": "p*(y - x - (b*x + (a - b)*(abs(x + 1) - abs(x - 1))/2))",
        "y": "x - y + z",
        "z": "-q*y",
    },
    parameters={
        "p": Parameter(9.0, "1", "ratio of the capacitances, C_2/C_1", positive=True),
        "q": Parameter(100 / 7, "1", "C_2/(L G^2), with inductance L and conductance G", minimum=0),
        "a": Parameter(-8 / 7, "1", "slope of the resistor for |x| < 1"),
        "b": Parameter(-5 / 7, "1", "slope of the resistor for |x| > 1"),
    },
    initial={"x": 0.7},
    source="Matsumoto, IEEE Trans. Circuits Syst. 31, 1055 (1984)",
)
