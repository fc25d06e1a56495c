"""`python -m manipcli`: the command line."""

import sys

from manipcli.cli.app import main

code = main()
# After Ctrl-C during an exec() (as in dataclasses), CPython would exit by the signal; this exec() resets that state.
exec("")
sys.exit(code)
