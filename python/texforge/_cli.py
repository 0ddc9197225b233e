"""The `texforge` command of the wheel: the stand-alone program, and `study`."""

from __future__ import annotations

import signal
import sys
import threading

from texforge import _texforge

__all__ = ["main"]


def main() -> int:
    """Run the command line with `sys.argv`; return the exit status."""
    sys.stdout.flush()
    sys.stderr.flush()
    if sys.argv[1:2] == ["study"]:
        # The one command that is written in Python; its packages are not loaded for the others.
        from texforge._study import command

        return command.main(sys.argv)
    if threading.current_thread() is not threading.main_thread():
        return _texforge.cli_main(sys.argv)
    # Python only notes Ctrl-C and raises later, in code that does not run meanwhile. With the
    # system's own answer in place, the Rust side installs its handler as in the other program.
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    except KeyboardInterrupt:
        return 130
    try:
        return _texforge.cli_main(sys.argv)
    except KeyboardInterrupt:
        return 130
    finally:
        signal.signal(signal.SIGINT, before)


if __name__ == "__main__":
    sys.exit(main())
