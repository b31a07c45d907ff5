"""Results for people to look at: terminal tables, pictures, the HTML page.

Here belongs what turns a fit into something to read or see and is no exchange format. It may import
`export`, `results` and what stands below them.
"""
