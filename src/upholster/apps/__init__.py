"""What people run: the command line, the studio, the server, notebooks.

- `cli`: the commands; `studio`: the page on which a project is made by hand; `server`: streams over HTTP
- `project`: a model, its samples and all settings; `notebook`: pictures and viewer in notebooks
"""
