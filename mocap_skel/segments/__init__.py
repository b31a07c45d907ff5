"""A segment's frame: rigid shapes, poses, and samples at which a marker is not where it belongs.

Here belongs what can be said of one segment's markers before any joint is known, and its pose by them; `prepare` is
the one way in for a whole clip. It may import `spherefit` and the ground.
"""
