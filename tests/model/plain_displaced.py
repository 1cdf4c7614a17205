"""Displaced meshes in plain Python, edge by edge: the oracle of the kernels. Slow, and simple."""

import math
from collections.abc import Callable

import numpy as np

Heights = Callable[[int, float, float], float]


def bilinear(values, row, column):
    """Look a height up in an array of texels, clamped to its outermost centres."""
    height, width = values.shape
    row, column = min(max(row - 0.5, 0), height - 1), min(max(column - 0.5, 0), width - 1)
    i, j = int(row), int(column)
    y, x = row - i, column - j
    down, right = min(i + 1, height - 1), min(j + 1, width - 1)
    upper = float(values[i, j]) * (1 - x) + float(values[i, right]) * x
    lower = float(values[down, j]) * (1 - x) + float(values[down, right]) * x
    return upper * (1 - y) + lower * y


def block_means(values, step):
    """Average an array over squares of `step` texels; at the end over as many as there are."""
    rows, columns = range(0, values.shape[0], step), range(0, values.shape[1], step)
    return np.array([[values[i : i + step, j : j + step].mean() for j in columns] for i in rows])


class PlainMesh:
    """Triangles as lists; a corner is (vertex, (row, column))."""

    def __init__(self, positions, triangles, chart):
        self.positions = [np.array(position, float) for position in positions]
        self.triangles = dict(enumerate(triangles))
        self.chart = dict(enumerate(chart))

    def sides(self, edge):
        """Triangles that have an edge, a pair of vertices, with the side's first corner."""
        return [
            (number, k)
            for number, corners in self.triangles.items()
            for k in range(3)
            if {corners[k][0], corners[(k + 1) % 3][0]} == set(edge)
        ]

    def length(self, edge):
        """Return what orders edges by their length in space."""
        a, b = edge
        return (
            float(((self.positions[a] - self.positions[b]) ** 2).sum()), max(edge), min(edge)
        )  # fmt: skip

    def edges_of(self, number):
        """Return a triangle's edges."""
        vertices = [vertex for vertex, _ in self.triangles[number]]
        return [tuple(sorted((vertices[k], vertices[(k + 1) % 3]))) for k in range(3)]

    def error(self, edge, values, amount, step):
        """Return how far the displacement along an edge is from linear, and that times its length."""
        worst, weight = 0.0, 0.0
        for number, k in self.sides(edge):
            heights = values[self.chart[number]]
            one, two = (np.array(self.triangles[number][n % 3][1]) / step for n in (k, k + 1))
            length = math.dist(one, two)
            if length > 16:
                return 1e20 * length, 1e20 * length * length * step
            steps = math.ceil(length)
            if steps < 2:
                continue
            found = [bilinear(heights, *(one + (two - one) * n / steps)) for n in range(steps + 1)]
            straight = np.linspace(found[0], found[-1], steps + 1)
            error = float(np.abs(found - straight).max()) * amount
            worst, weight = max(worst, error), max(weight, error * length * step)
        return worst, weight

    def bisect(self, edge):
        """Cut an edge and its triangles at its middle."""
        middle = len(self.positions)
        self.positions.append((self.positions[edge[0]] + self.positions[edge[1]]) / 2)
        for number, k in self.sides(edge):
            first, last, top = (self.triangles[number][(k + n) % 3] for n in range(3))
            place = tuple((np.array(first[1]) + np.array(last[1])) / 2)
            self.triangles[number] = [first, (middle, place), top]
            self.triangles[max(self.triangles) + 1] = [(middle, place), last, top]
            self.chart[max(self.triangles)] = self.chart[number]

    def refine(self, values, amount, tolerance, most, step):
        """Bisect the edge of the largest weight, again and again; return the largest error that is left."""
        while True:
            edges = {edge for number in self.triangles for edge in self.edges_of(number)}
            errors = {edge: self.error(edge, values, amount, step) for edge in edges}
            above = {edge: weight for edge, (error, weight) in errors.items() if error > tolerance}
            if not above:
                return 0.0
            worst = max(above, key=above.__getitem__)
            while True:
                near = {edge for number, _ in self.sides(worst) for edge in self.edges_of(number)}
                longest = max(near, key=self.length)
                if longest == worst:
                    break
                worst = longest
            if len(self.triangles) + len(self.sides(worst)) > most:
                return max(error for error, _ in errors.values())
            self.bisect(worst)
