"""Ours and published joint centres against references that lie beside or inside real clips."""
