"""How the kernels are put together."""

import importlib
import pkgutil

from numba.core.registry import CPUDispatcher

import ploughval.piv


def test_every_kernel_holds_its_own_parts_so_that_no_copy_is_shared_in_a_process():
    modules = [
        importlib.import_module(f"ploughval.piv.{module.name}")
        for module in pkgutil.iter_modules(ploughval.piv.__path__)
    ]
    functions = {
        value.__name__: value.targetoptions
        for module in modules
        for value in vars(module).values()
        if isinstance(value, CPUDispatcher)
    }
    kernels = {name for name, options in functions.items() if not options.get("no_cpython_wrapper")}
    assert kernels == {"match_points", "read_points", "match_bands", "divide_points"}
    shared = [
        name
        for name, options in functions.items()
        if name not in kernels and not options.get("forceinline") and options.get("inline") != "always"
    ]
    assert len(functions) > 20
    assert shared == []
