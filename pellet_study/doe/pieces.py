"""The pieces of a set of settings that hang together, found on a grid over the box.

A quadratic response may be acceptable on both sides of a ridge and not upon it; one box around both would hold
settings that meet nothing.
"""

import numpy as np

from pellet_study.doe.desirability import Wanted

GRID = {1: 1025, 2: 129, 3: 41, 4: 17, 5: 9}
"""{number of factors: grid points along each}; with more factors pieces are not told apart."""


class Pieces:
    """Which piece of the set a point of the box [-1, 1]^k belongs to.

    A grid point counts to the set where every response takes an acceptable value between its neighbours, so that a
    thin set does not fall apart on the grid; pieces less than two steps of the grid apart count as one.
    """

    def __init__(self, wanted: Wanted):
        from scipy.ndimage import label, maximum_filter, minimum_filter

        k = len(wanted[0][0].factors)
        self.size = GRID.get(k, 1)
        shape = (self.size,) * k
        grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, self.size)] * k, indexing="ij"), axis=-1).reshape(-1, k)
        reached = np.ones(shape, dtype=bool)
        for response, goal in wanted if self.size > 1 else ():
            predicted, (low, high) = response.predict(grid).reshape(shape), goal.accepted
            reached &= (maximum_filter(predicted, 3) >= low) & (minimum_filter(predicted, 3) <= high)
        self.labels = label(reached, structure=np.ones((3,) * k))[0]

    def of(self, points) -> np.ndarray:
        """Number (n_points,) of the piece that each point (n_points, k) lies in; 0 where in none."""
        places = np.rint((np.atleast_2d(points) + 1) / 2 * (self.size - 1)).astype(int)
        return self.labels[tuple(places.T)]
