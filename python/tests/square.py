"""A square of cloth for the tests."""

import numpy as np

import toile

SQUARE = [[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]]
# lies flat: u to +x, v to -z
FLAT = (-np.sqrt(0.5), 0, 0, np.sqrt(0.5))


def square(edge_length=0.05):
    garment = toile.Garment("square", edge_length)
    garment.add_panel("square", SQUARE, position=(-0.2, 0.5, 0.2), quaternion_xyzw=FLAT)
    return garment
