"""Values of a KRL program, with what is not known of them.

Modules: ``number_kinds`` (numbers that are known but for their last digits, for whole turns or for their type),
``evaluation`` (what expressions come to), ``value_types`` (what a variable of a type makes of a value),
``variable_scope`` (variables by name, and parameters that stand for others).
"""
