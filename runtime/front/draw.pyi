# What the module loads on first use; tests/test_front.py writes this file with --update.
from synchain.models.sweeps.distribution import lorentzian as lorentzian
from synchain.models.sweeps.distribution import normal as normal
from synchain.models.sweeps.distribution import uniform as uniform
