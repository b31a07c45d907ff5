"""One joint: its centre in the parent's frame, the evidence for it, and what anatomy adds.

Here belongs all estimation of a joint, for one clip or from several, and the pose of the segment that hangs from it.
It may import `segments`, `figure` and `spherefit`, and the ground.
"""
