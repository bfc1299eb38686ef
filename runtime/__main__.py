"""`python -m synchain.runtime` is the command `synchain`."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
