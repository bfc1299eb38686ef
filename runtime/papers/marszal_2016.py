"""
Thresholds of dry-friction oscillators
======================================

Marszal, Saha, Jankowski & Stefański, European Physical Journal Special Topics (2016).

Springs join masses on a moving belt, at ω = 1.15.  The paper finds by simulation up to which coupling two, three and
four masses synchronise.  Our numbers are zeros of the master stability function, divided by the exact eigenvalues of
the chains.  The synchronous motion is periodic, so the exponents need no averages.

All three numbers agree to the printed digits.  ``synchain paper`` makes the paper's figures.
"""

import numpy as np

import synchain as sc

pair = sc.Scene(topology=sc.graphs.chain(2), parameters={"omega": 1.15})
function = sc.msf(pair, np.linspace(0, 0.6, 61))
largest = [np.abs(sc.graphs.chain(n).spectrum.values).max() for n in (2, 3, 4)]
two, three, four = function.intervals[0][1] / np.array(largest)
reproduction = sc.results.Reproduction(
    {
        "two oscillators up to": (0.233, two, 0.0005),
        "three oscillators up to": (0.155, three, 0.0005),
        "four oscillators up to": (0.136, four, 0.0005),
    }
)
print(reproduction)
function.plot()
