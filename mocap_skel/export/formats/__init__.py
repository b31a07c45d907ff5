"""One module a result format. Each registers itself, and is found by lying here: see `export.registry`."""
