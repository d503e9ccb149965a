"""What computes evaluations: threads of this process, other processes, a cluster. Not what to evaluate.

Read in this order:

- ``evaluator``: the two contracts, and the threads of this process.
- ``job``: what a worker receives and returns.
- ``pool``: jobs on workers that may die.
- ``processes``: workers of this machine. ``serving``: what one of them does.
- ``dask_workers``: of a Dask cluster. ``slurm``: started by SLURM.
- ``malloc``: keeps the memory of long-lived processes compact.
"""
