"""The shortest pair of vectors that generates a lattice."""

__all__ = ["Vector", "shortest_pair"]

Vector = tuple[float, float]


def shortest_pair(one: Vector, other: Vector) -> tuple[Vector, Vector]:
    """Return the two shortest vectors of which one and the other are sums, the shorter first.

    It is (0, 0) if both are multiples of one vector. This is Gauss's reduction, in a fixed order of
    operations.
    """
    short, long = one, other
    while True:
        if short[0] * short[0] + short[1] * short[1] > long[0] * long[0] + long[1] * long[1]:
            short, long = long, short
        square = short[0] * short[0] + short[1] * short[1]
        steps = round((short[0] * long[0] + short[1] * long[1]) / square) if square > 0 else 0
        if steps == 0:
            return short, long
        long = long[0] - steps * short[0], long[1] - steps * short[1]
