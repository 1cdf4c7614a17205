"""Work in many tasks: batches of covers, and surfaces larger than memory, on this machine or on a cluster.

A batch: jobs file ──► jobs ──► unfinished jobs ──► Dask's workers ──► record, contact sheet

- `jobs`: reads the file; `record`: results of finished jobs; `sheet`: shows the results
- `job_runs`: jobs on Dask (``pip install "upholster[cluster]"``; nothing else imports it); `dask_worker`: the
  setup of each worker

A large surface: plan ──► parcels' blocks, class after class ──► parcels' labels ──► charts ──► tiles

Each of these is a task, and runs as soon as its inputs are ready. All data between tasks is in a folder next
to the outputs, on a disk or at a URL. A task that lays or labels a parcel reads its neighbours' blocks there,
and a task that paints a tile reads its charts. Finished work is kept when a worker or the whole run is
killed.

- `storage`: that folder; `task_files`: the format of its files; `work`: the content of tasks
- `task_order`: their order, on threads or on Dask's workers; `task_covering`: the entry points for
  `upholster.pipeline`
"""
