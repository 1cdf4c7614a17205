"""Dask: tasks on processes of this machine, or on an existing cluster.

``pip install "upholster[cluster]"``; nothing else imports Dask.

- `job_runs`: runs jobs; `dask_worker`: the setup of each worker
"""

from upholster.cluster.job_runs import Outcome, Run, cluster_pool, run_jobs

__all__ = ["Outcome", "Run", "cluster_pool", "run_jobs"]
