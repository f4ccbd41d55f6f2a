"""Dense inverse search of OpenCV, read at the points of the grid."""

import cv2
import numpy as np
from adaptor import Found, Measure, Picture, finite, grid


def measure_with(flow: cv2.DISOpticalFlow) -> Measure:
    """Measure that calculates the flow of every pixel and reads it at the points."""

    def measure(reference: Picture, current: Picture) -> Found:
        field = flow.calc(reference, current, None)
        points = grid(reference.shape)
        column, row = points.T.astype(int)
        return finite(points, field[row, column].astype(np.float64))

    return measure
