"""`mocap-skel` whose children do what the names of clips say: crash, hang, or eat memory. Run as a program."""

import os
import sys
import time

import mocap_skel.pipeline.engine as engine

sound = engine.work


def work(task, folder=None):
    """`engine.work`, but for these clips."""
    name = task.path.name
    if "crash" in name:
        os.kill(os.getpid(), 11)
    if "hang" in name:
        time.sleep(3600)
    if "hungry" in name:
        bytearray(1 << 40)
    return sound(task, folder)


def main():
    """Run a command line with the changed program; the words before it are a clip's seconds."""
    import brittle

    from mocap_skel.cli import main as program

    # Children find it by its name.
    engine.work = brittle.work
    engine.SECONDS = float(sys.argv[1])
    program(sys.argv[2:])


if __name__ == "__main__":
    main()
