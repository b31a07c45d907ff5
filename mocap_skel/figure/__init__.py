"""The figure: which segments it has, how they hang together, which markers and priors belong to them.

Here belongs what a skeleton file (TOML) says and how it is checked. It may import the ground (`errors`,
`text`) only.
"""
