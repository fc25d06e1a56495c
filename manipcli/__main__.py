"""`python -m manipcli`: the command line."""

import sys

from manipcli.cli.app import main

sys.exit(main())
