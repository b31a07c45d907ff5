"""Which label of a clip is which marker: association files, and guesses where there is none.

Here belongs everything between a clip's labels and the figure's markers. It may import `joints`,
`segments`, `figure` and `spherefit`, and the ground.
"""
