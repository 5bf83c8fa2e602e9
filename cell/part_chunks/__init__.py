"""Large parts in chunks of whole beads, which are planned and checked side by side.

Modules: ``chunking`` (where a part is cut), ``chunk_starts`` (where the arm comes from to each chunk), ``joins`` (from
the end of a chunk to the next), ``chunked_plan`` (the plan of the part), ``chunk_run`` (one chunk run in time and
checked as it is run), ``runs_ahead`` (chunks that are run while others are planned), ``chunked_run`` (the plan run),
``least_values`` (the least clearance and margin of all). Where a part is cut depends on the part alone, and so does
what is found, in whichever process.
"""
