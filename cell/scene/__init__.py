"""From a case and the shape of the part to a MuJoCo model, the arm as arrays, and targets on the table.

Modules: ``compose`` (the whole cell), ``scene`` (what comes of it), ``composition`` (a cell while it is put
together), ``world`` (floor, light), ``equipment`` (robot, tool, positioner), ``workpiece`` (support, part, deposits,
fixtures), ``table_axes`` (E1 and E2), ``table_kinematics`` (where the part is at any table angles), ``table_freedom``
(how near to up a table brings a direction), ``calibration`` (a positioner as it was measured), ``contacts`` (which
pairs of geoms count), ``absent_shapes`` and ``part_contact`` (what is not there, or does not stand where it should),
``drives`` (speeds and accelerations of the axes), ``placement`` (targets in the arm's base), ``site_frames`` (the
tool on the flange, the part on the table), ``standalone`` (the cell as one MJCF).
"""
