"""Tables of text: the readers of TRC, Motive, Qualisys and plain tables, and what they share.

`trc`, `motive`, `qualisys` and `plain` each know a header; `formats/` says how their files are known. `source` gives a
file's text, whatever its encoding; `layout` is what a header tells; `lines` knows which rows are whole; `rows` reads the
numbers with pandas and names one that is wrong; `timing` makes frames and a rate of its first columns; `raw_table`
puts them together.
"""
