"""Maps of table poses, rolls and placements.

Modules: ``sweep``, ``grid`` (the poses asked for), ``workers``
(all cores), ``log`` (what is kept to resume), ``ranking``, ``variants``, ``picked_pose``.
"""
