# What the module loads on first use; tests/test_front.py writes this file with --update.
from synchain.models.graphs.families import Family as Family
from synchain.models.inputs.options import integer_option as integer_option
from synchain.models.inputs.options import integers_option as integers_option
from synchain.models.inputs.options import probability_option as probability_option
from synchain.models.inputs.plugin_files import allow_code as allow_code
from synchain.models.mechanics.contact import FrictionLaw as FrictionLaw
from synchain.models.mechanics.oscillator import Oscillator as Oscillator
