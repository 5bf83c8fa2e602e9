"""Exit codes of every command. ``cell.cli.main`` turns errors into them.

raise InputError("..")         # becomes BAD_INPUT; any other exception becomes NO_VERDICT
"""

FEASIBLE = 0  # or done
INFEASIBLE = 1
BAD_INPUT = 2
# EX_SOFTWARE of sysexits.h: never a verdict and no fault of the input, but an error of the program itself, too little
# memory, or a worker process that was killed from outside
NO_VERDICT = 70
ENDED_BY_SIGNAL = 128  # and the signal's number
INTERRUPTED = 130
