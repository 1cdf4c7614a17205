"""At which waves a sample repeats, how surely, and its phase at every pixel.

`lattice` finds them (`find_lattice`): `planes` says what of the sample is looked at, `peaks` which waves
stand out of the spectrum, `following` how steadily one goes through the sample, `choice` which one or two
of them all others are made of.
"""

from upholster.lattice.lattice import Lattice, find_lattice

__all__ = ["Lattice", "find_lattice"]
