"""A fit as people ask for it: rows and columns, sentences, series over time, other axes.

Here belongs what is computed from a finished fit and is no file format and no picture. It may import
`rig`, `fit`, `labels` and what stands below them.
"""
