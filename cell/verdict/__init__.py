"""The verdict on a part at a table pose: every target, bead and travel, with reasons and measures.

Modules: ``check`` (the verdict at one pose), ``result`` (what it is), ``by_table_mode`` (with the table as the case
asks), ``indexed``, ``order_search`` and ``group_verdicts`` (groups of layers, each at a table pose of its own),
``coordinated`` (a table that moves along the beads), ``best_pose`` (the best fixed pose), ``table_use`` (what the
table does), ``all_reasons`` (every reason of a target), ``severity`` (which target is worst), ``failure_words`` and
``words`` (verdicts in words).
"""
