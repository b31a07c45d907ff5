"""The way of a call: what to do with a clip, and from its file to its result files.

Here belongs what ties readers, fit and writers together, in this process or in a child. It may import
everything but `cli`.
"""
