"""Photographs as a series: order, times and their uncertainty, copies, gaps."""
