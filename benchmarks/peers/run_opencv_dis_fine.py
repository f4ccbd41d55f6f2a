"""Measures with OpenCV's dense inverse search, at full resolution."""

import cv2
from adaptor import serve
from flow import measure_with


def fine() -> cv2.DISOpticalFlow:
    """The slowest preset, but down to the finest scale and with more variational refinement."""
    flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    flow.setFinestScale(0)
    flow.setVariationalRefinementIterations(10)
    return flow


if __name__ == "__main__":
    cv2.setNumThreads(1)
    raise SystemExit(serve("opencv-python-headless", measure_with(fine())))
