"""The studio: a local page on which a project is made by hand. Needs the extra ``studio``.

`routes` has the routes, `entry` the checks in front of them, `folder` the uploaded files, `worker` the
server's side of the process that holds the project, `worker_process` that process itself; `words` writes the
equivalent command, `overlays` draws lines over the model, `uncovered` shows parts without a sample,
`model_picture` draws the models on the shelf. The page is in ``page``.
"""
