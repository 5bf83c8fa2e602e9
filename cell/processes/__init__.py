"""Work shared out among processes.

Modules: ``worker_pool`` (the worker processes; results come in the order of the items), ``work_round`` (hands out items
until all results are there, and what else may be done by then), ``critical_path`` (how long a round takes by processor
time alone), ``worker`` (runs in a worker process), ``worker_link`` (this process' end of the pipe to a worker),
``own_process`` (starts such processes, and decides which of them Ctrl-C interrupts).
"""
