"""The `metamer` command: reads the words, calls the package, turns errors into exit codes.

0 pass, 1 warn, 2 fail, 3 the two sides cannot be compared, 4 a file is unusable, 64 wrong usage; 128 and the number of
the signal that ended it: 130 after Ctrl-C, 143 after SIGTERM.
"""

# Ctrl-C is not heard before these imports are done: nothing slow may be among them.
from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from typing import TextIO

from ..runtime.shutdown import closing_line, end_on_signals, finished


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code.

    Without `words` it takes those of the process, and then also handles the process's signals.
    """
    if words is None:
        end_on_signals()
    code = _ended(words)
    if words is None:
        finished(code)
    return code


def _ended(words: Sequence[str] | None) -> int:
    from ..runtime.errors import MetamerError

    # Python has None for a stream that whoever started it has closed.
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        # A terminal that has no Δ gets a question mark, not a traceback.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    try:
        code = _run(words)
        # Here, and not while Python shuts down, a reader that has left can be forgiven.
        sys.stdout.flush()
        return code
    except MetamerError as reason:
        print(f"metamer: {reason}", file=sys.stderr)
        return reason.exit_code
    except KeyboardInterrupt as reason:
        # Called by another program, which has kept its signals.
        sys.stderr.write(closing_line(signal.SIGINT, str(reason)))
        return 130
    except BrokenPipeError:
        # The reader of our output has left, as `head` does; what is still buffered goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as reason:
        # A full disk, a folder where a file should go. Our own files have words of ours where there is no room: what
        # has no name is what our output is sent to.
        from ..runtime.files import of_the_system

        print(f"metamer: {of_the_system(reason, 'standard output')}", file=sys.stderr)
        return 4


def _run(words: Sequence[str] | None) -> int:
    from .parser import parser

    words = sys.argv[1:] if words is None else words
    command = parser(words)
    args = command.parse_args(words)
    if args.version:
        from ..runtime.distribution import installed_version

        print(f"metamer {installed_version()}")
        return 0
    if not hasattr(args, "run"):
        command.print_help()
        return 64
    from ..runtime.worker_pool import one_thread
    from .output import TEXT_OUTPUTS, figures_alone

    one_thread()
    with figures_alone(*(getattr(args, name, None) for name in TEXT_OUTPUTS)):
        return args.run(args)


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123 (pathlib may not be imported yet)


if __name__ == "__main__":
    sys.exit(main())
