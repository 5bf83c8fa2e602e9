"""From meshes to a job: the part sliced, its beads and targets, and the composed cell.

Modules: ``part_input`` (meshes and bodies), ``job`` (everything that a check needs).
"""
