"""`python -m texforge` is the `texforge` command."""

import sys

from texforge._cli import main

if __name__ == "__main__":
    sys.exit(main())
