"""At which waves a sample repeats, how surely, and its phase at every pixel.

`lattice` finds them (`find_lattice`).
"""

from upholster.lattice.lattice import Lattice, find_lattice

__all__ = ["Lattice", "find_lattice"]
