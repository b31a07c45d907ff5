"""The fit as a figure of rigid bones: constant lengths, a rest pose, no gaps.

Here belongs what formats for animators need and no file format knows. It may import `skeleton_fit` and
what stands below it.
"""
