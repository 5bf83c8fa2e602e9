"""The way of a table that moves along the beads, before the arm is planned on it.

Modules: ``table_schedule`` (the deposition direction near to up, the axes slow), ``table_check`` (what stands on the
table against the cell).
"""
