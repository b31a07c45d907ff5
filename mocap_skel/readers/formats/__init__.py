"""One module an input format. Each registers itself, and is found by lying here: see `readers.registry`."""
