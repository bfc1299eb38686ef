# What the module loads on first use; tests/test_front.py writes this file with --update.
from synchain.codegen.export import to_c as to_c
from synchain.codegen.export import to_numba as to_numba
from synchain.codegen.export import to_python as to_python
from synchain.models.presentation.equations_text import latex as latex
from synchain.models.presentation.equations_text import text as text
