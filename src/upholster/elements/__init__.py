"""What a sample is made of: the waves at which it repeats, and the joints between its stones or boards.

`lattice` finds waves, how sure they are, and their phase at every pixel (`find_lattice`): `planes` says what
of the sample is looked at, `peaks` which waves stand out of the spectrum, `following` how steadily one goes
through the sample, `choice` which one or two of them all others are made of. `joints` finds thin lines, and
how far each pixel is from the nearest (`find_joints`).
"""

from upholster.elements.joints import Joints, find_joints
from upholster.elements.lattice import Lattice, find_lattice

__all__ = ["Joints", "Lattice", "find_joints", "find_lattice"]
