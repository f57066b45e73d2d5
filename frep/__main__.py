"""`python -m frep` is the command `frep`."""

import sys

from frep.cli import main

sys.exit(main())
