"""`python -m manipcli`: the command line."""

import sys

from manipcli.cli.app import main

code = main()
# Where Ctrl-C came while a text was executed, as dataclasses do, CPython would end by the signal and not with the code.
exec("")
sys.exit(code)
