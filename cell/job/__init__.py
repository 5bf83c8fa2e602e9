"""From meshes to a job: the part sliced, its beads and targets, and the composed cell.

Modules: ``part_input`` (meshes and bodies), ``beside_body`` (solids of a part that are neither body nor sub-volume),
``built_solids`` (solids of built sub-volumes outside their layers), ``job`` (everything that a check needs),
``cell_without_part`` (a cell without a part), ``build_order`` and ``reordered`` (the order of layers),
``table_groups`` (what is built at one table pose), ``table_section_check`` (the case's section ``table`` against the
part), ``table_winding`` (beads that go further round than the table), ``overhang_check`` (targets laid over nothing),
``bead_support`` (which of another slicer's beads lie over nothing or in metal), ``wire_in_metal`` (where the wire
would run through metal).
"""
