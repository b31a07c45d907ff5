"""The thesis's experiments: resampling (6.1), speed (6.4), accuracy (6.6), the table of methods (6.3).

Here belongs an experiment, its tables and its figures. It may import `report` and what stands below it.
The thesis is J. K. Knight, Rotation Points from Motion Capture Data Using a Closed Form Solution, 2008.
"""
