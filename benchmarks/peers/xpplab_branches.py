"""AUTO as XPPAUT has it, by xpplab: a model is text in XPPAUT's language."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

COLUMN = """
par p=-60
s(v)=5/(1+exp(0.56*(6-v)))
y0'=u0
u0'=325*s(y1-y2)-200*u0-10000*y0
y1'=u1
u1'=325*(p+108*s(135*y0))-200*u1-10000*y1
y2'=u2
u2'=37125*s(135*y0/4)-100*u2-2500*y2
@ dt=0.0001, total=1
done
"""


def rest() -> Mapping[str, Sequence[float]]:
    """Return folds and Hopf points of Jansen and Rit's column."""
    import xpplab

    # With tighter tolerances than the default ones it loses a Hopf point.
    steps = {"ds": 0.01, "dsmin": 1e-6, "dsmax": 0.5, "nmax": 20_000, "npr": 20_000}
    with TemporaryDirectory() as folder:  # the model works in the folder of its file
        path = Path(folder, "column.ode")
        path.write_text(COLUMN, encoding="utf-8")
        model = xpplab.load(path)
        branch = model.auto.equilibria("p", parmin=-100, parmax=400, normmax=1e5, **steps)
        labels = {"fold": "LP", "Hopf": "HB"}
        return {kind: [each.value for each in branch.special(label)] for kind, label in labels.items()}


CASES: Mapping[str, Callable[[], Mapping[str, Sequence[float]]]] = {"Jansen-Rit, rest": rest}
