"""`python -m mocap_skel` is `mocap-skel`."""

from mocap_skel.cli import main

if __name__ == "__main__":
    main()
