"""Measures with OpenCV's dense inverse search, its preset called medium."""

import cv2
from adaptor import serve
from flow import measure_with

if __name__ == "__main__":
    cv2.setNumThreads(1)
    medium = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    raise SystemExit(serve("opencv-python-headless", measure_with(medium)))
