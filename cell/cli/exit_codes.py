"""Exit codes of every command. ``cell.cli.main`` turns errors into them.

raise InputError("..")         # becomes BAD_INPUT; any other exception becomes PROGRAM_ERROR
"""

FEASIBLE = 0  # or done
INFEASIBLE = 1
BAD_INPUT = 2
PROGRAM_ERROR = 70  # EX_SOFTWARE of sysexits.h: never a verdict
ENDED_BY_SIGNAL = 128  # and the signal's number
INTERRUPTED = 130
