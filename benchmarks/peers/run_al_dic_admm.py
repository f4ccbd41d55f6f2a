"""Measures with al-dic, local subsets and the global step in turn."""

from adaptor import serve
from aldic import measure_with

if __name__ == "__main__":
    raise SystemExit(serve("al-dic", measure_with(global_step=True)))
