# What the module loads on first use; tests/test_front.py writes this file with --update.
from synchain.models.dynamics.observable import Observable as Observable
from synchain.models.dynamics.observable import end as end
from synchain.models.dynamics.observable import energy as energy
from synchain.models.dynamics.observable import maximum as maximum
from synchain.models.dynamics.observable import mean as mean
from synchain.models.dynamics.observable import minimum as minimum
from synchain.models.dynamics.observable import nodes as nodes
from synchain.models.dynamics.observable import rate as rate
from synchain.models.dynamics.observable import variance as variance
