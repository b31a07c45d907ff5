"""Tables of text: the readers of TRC, Motive, Qualisys and plain tables, and what they share.

`trc`, `motive`, `qualisys` and `plain` each know a header; `formats/` says how their files are known. `source` gives a
file's lines, whatever its encoding; `rows` reads its numbers with pandas and knows where one is wrong; `timing` makes
frames and a rate of its first columns; `raw_table` puts the three together.
"""
