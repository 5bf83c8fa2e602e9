"""Work shared out among processes.

Modules: ``worker_pool`` (who does the work, and results in the order of the items), ``work_round`` (items handed out
until all are back), ``worker`` (what a worker process does), ``worker_link`` (a worker as this process sees it),
``own_process`` (how such processes start, and who hears Ctrl-C).
"""
