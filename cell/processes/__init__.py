"""Work shared out among processes.

Modules: ``worker_pool`` (who does the work, and results in the order of the items), ``worker`` (what a worker process
does), ``own_process`` (how such processes start, and who hears Ctrl-C).
"""
