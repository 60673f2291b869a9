"""The commands of `omniroll`, one module each.

Such a module has
    SUMMARY                    one line for the help
    EXAMPLES                   for the help: calls, each with what it does
    add_arguments(parser)      its arguments, on an argparse parser; those of shells that complete files say so, with
                               shtab's FILE and DIRECTORY
    run(arguments) -> int      the work; returns the exit code. arguments.parser is the whole parser
Its name is the command's. The exit codes are below; omniroll.cli makes them of the errors that a command lets pass.
"""

FAILED = 1  # something that the work needs is missing or cannot be written
BAD_CALL = 2  # the call or the scene makes no sense
STOPPED = 3  # the simulation stopped before its end
NOT_THIS_MODEL = 4  # a fit came to an end, and its residuals say that the model is none of the log's
CLOSED = 141  # whoever reads the output has closed it, as `head` does: 128 and the number of SIGPIPE
INTERRUPTED = 130  # by Ctrl-C; a run that another signal ended gives 128 and the signal's number, 143 for SIGTERM
