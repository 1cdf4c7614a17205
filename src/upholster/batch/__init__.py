"""Many jobs, each a `cover`: exemplars times surfaces times options, on the cores of one machine or many.

jobs file ──► jobs ──► those that are not done yet ──► Dask's workers ──► record, contact sheet

`jobs` reads the file, `record` knows what is done already, `upholster.cluster` runs the others on Dask,
`sheet` shows what came of them.
"""

from upholster.batch.jobs import Job, check_apart, check_within, read_jobs
from upholster.batch.record import Record
from upholster.batch.sheet import write_sheet

__all__ = ["Job", "Record", "check_apart", "check_within", "read_jobs", "write_sheet"]
