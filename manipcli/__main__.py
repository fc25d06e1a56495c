"""`python -m manipcli` and the script `manipcli`: the command line."""

import sys


def main() -> int:
    """Runs the command line and returns its exit code; Ctrl-C ends also the imports without a traceback."""
    try:
        from manipcli.cli.app import main as command_line

        code = command_line()
        # After Ctrl-C during an exec(), as in dataclasses, CPython would exit by the signal; this exec() resets that.
        exec("")
    except KeyboardInterrupt:
        sys.stderr.write("error[USE002]: interrupted\n")
        return 2
    return code


if __name__ == "__main__":
    sys.exit(main())
