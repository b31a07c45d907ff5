"""`python -m mocap_skel` is `mocap-skel`."""

import signal
import sys


def main() -> None:
    """Run the command line, also where Ctrl-C comes before it is loaded or when all is said."""
    try:
        from mocap_skel.cli import INTERRUPTED
        from mocap_skel.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("mocap-skel: interrupted\n")
        sys.exit(130)
    try:
        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    main()
