"""Anatomical axes of the segments, the joint angles between them, and how well each angle is known.

Here belongs what makes angles of a fit, whatever file they go to. It may import `skeleton_fit`, `segments`,
`joints`, `figure` and the ground, and no other room.
"""
