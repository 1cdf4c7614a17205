"""Many jobs, each a `cover`: exemplars times surfaces times options, on the cores of one machine or many.

jobs file ──► jobs ──► unfinished jobs ──► Dask's workers ──► record, contact sheet

`jobs` reads the file, `record` keeps the results of finished jobs, `upholster.cluster` runs the others on
Dask, `sheet` shows the results.
"""

from upholster.batch.jobs import Job, check_apart, check_within, read_jobs
from upholster.batch.record import Record
from upholster.batch.sheet import write_sheet

__all__ = ["Job", "Record", "check_apart", "check_within", "read_jobs", "write_sheet"]
