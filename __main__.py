"""`python -m metamer`: the same as the command `metamer`."""

import sys

from .cli.main import main

if __name__ == "__main__":
    sys.exit(main())
