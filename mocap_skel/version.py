"""The program's version, which results name; on the ground, so that every room may."""

__version__ = "0.1.0"
