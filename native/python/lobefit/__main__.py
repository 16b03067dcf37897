"""`python -m lobefit` is the command line."""

import sys

from lobefit.command_line import main

sys.exit(main())
