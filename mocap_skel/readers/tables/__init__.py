"""Tables of text: what the readers of TRC, Motive, Qualisys and plain tables share.

`source` gives a file's lines, whatever its encoding; `rows` reads its numbers with pandas and knows where one is wrong;
`timing` makes frames and a rate of its first columns; `raw_table` puts the three together.
"""
