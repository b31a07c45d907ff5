"""Gait: when the feet strike the ground and leave it, and joint angles over the cycles between.

Here belongs what is true of walking only. It may import `angles`, `rig`, `skeleton_fit` and what is below them.
"""
