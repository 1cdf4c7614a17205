"""Coverings: each is a sample and the surface that it covers, all of a model or some of its parts.

- `request`: what is to be covered, with which samples, and how; checked before any file is read
- `pins`: regions that stay as they were
- `request_reading`: a request's files, read as coverings
- `covering`: one covering: its prepared synthesis, its quilt and its texels
- `joint_work`: the work over all coverings of a model, and the report's facts about them
"""
