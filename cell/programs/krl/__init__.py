"""The language KRL: lines, expressions, statements, files, and their execution as far as it moves the arm.

Modules: ``lexing`` (lines as tokens), ``expressions`` (tokens as expressions), ``syntax`` (files as statements),
``sources`` (files beside each other), ``values`` (what expressions come to), ``state`` (what the controller holds, and
the moves it makes), ``setting`` (assignments that change it), ``bas`` (the sub-program BAS), ``execution``.
"""
