"""The verdict on a part at a table pose: every target, bead and travel, with reasons and measures.

Modules: ``check`` (the verdict), ``all_reasons`` (every reason of a target), ``severity`` (which target is worst),
``failure_words`` and ``words`` (verdicts in words).
"""
