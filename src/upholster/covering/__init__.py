"""Requests: what is to be covered, with which samples, how, and with which results; and their work.

- `request`: the request, and everything that follows from it: surface, sample, scene, quilt, model
- `sample_arguments`: its samples, as a caller gives them; `pins`: regions that stay as they were
- `synthesis`: `synthesize`, a request's quilt in one call
- `joint_work`: the work over the requests of all samples; `cover_report`: the report about it
- `notes`: notes before the work: what will disappoint, and what helps
- `photos`: `upholster prepare` and `fill`; `tasks`: work in many tasks; `measure`: measures of a result
"""
