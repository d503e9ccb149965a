"""Who computes evaluations: threads of this process, other processes, a cluster. Never which, or why.

Read in this order:

- ``evaluator``: the two contracts, and the threads of this process.
- ``job``: what a worker gets and gives back.
- ``pool``: jobs on workers that may die.
- ``processes``: workers of this machine. ``dask_workers``: of a Dask cluster. ``slurm``: started by SLURM.
- ``malloc``: keeps the memory of long-lived processes compact.
"""
