"""The thesis's experiments: resampling (6.1), speed (6.4), accuracy (6.6), the table of methods (6.3)."""
