"""The language KRL: lines, expressions, statements, files, and their execution as far as it moves the arm.

Modules: ``lexing`` (lines as tokens), ``expressions`` (tokens as expressions), ``statements`` and ``line_forms``
(lines as statements), ``syntax`` (files as statements), ``sources`` (files beside each other), ``values`` (numbers,
types, and what expressions come to), ``inner_calls`` (functions called inside other statements), ``data``
(variables), ``state`` (what the controller holds, and the moves it makes), ``moving`` (where motions go), ``triggers``
and ``events`` (what happens on the way), ``setting`` (assignments that change the state), ``bas`` (the sub-program
BAS), ``execution``.
"""
