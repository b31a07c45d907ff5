"""Result formats: what each is called, which files it makes, and how.

Here belongs one module a format, and the writing of files whole or not at all. It may import `rig`,
`results` and what stands below them.
"""
