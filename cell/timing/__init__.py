"""The time law under the axes' speeds and accelerations, and corners as a controller rounds them.

Modules: ``time_law``, ``time_grid`` and ``greatest_speeds`` (what it is made of), ``blending``. Arrays in, arrays out;
nothing here knows a case or a scene.
"""
