"""The structure of a sample: the waves at which it repeats, and the joints between its stones or boards.

`lattice` finds waves, how certain they are, and their phase at every pixel (`find_lattice`). `planes`
computes the planes that are examined, `peaks` finds waves that stand out of the spectrum, `following`
measures how steadily one runs through the sample, `choice` picks one or two waves that all others are made
of. `joints` finds thin lines, and the distance of each pixel from the nearest (`find_joints`).
"""

from upholster.elements.joints import Joints, find_joints
from upholster.elements.lattice import Lattice, find_lattice

__all__ = ["Joints", "Lattice", "find_joints", "find_lattice"]
