"""From meshes to a job: the part sliced, its beads and targets, and the composed cell.

Modules: ``part_input`` (meshes and bodies), ``beside_body`` (what of a whole part is neither body nor sub-volume),
``built_solids`` (what of sub-volumes that are built already no layer holds), ``job`` (everything that a check needs),
``cell_without_part`` (a cell without a part), ``build_order`` and ``reordered`` (the order of layers),
``table_groups`` (what is built at one table pose), ``table_section_check`` (the case's section ``table`` against the
part), ``table_winding`` (beads that go further round than the table), ``overhang_check`` (what is laid in the air),
``bead_support`` (which of another slicer's beads lie over nothing), ``wire_in_metal`` (where the wire would run
through metal).
"""
