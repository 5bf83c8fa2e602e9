"""How the layers follow one another: planar, cylindrical, non-uniform cylindrical, conical, revolved.

Modules: ``slice`` (any of them), ``planar``, ``cylindrical``, ``nonuniform``, ``printed_body`` (the body itself).
"""
