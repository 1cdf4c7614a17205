"""From a photo to a sample: `preparation` has the steps.

`rectify` makes a rectangle seen at an angle upright, `perspective` finds that rectangle, and `even_light`
removes shading.
"""
