"""The studio: a local page on which a project is made by hand. Needs the extra ``studio``.

`routes` has the routes, `entry` what stands before them, `folder` what was dropped, `worker` the process that
holds the project and `worker_process` what that does; `words` tells the command that makes the same. The page
itself is in ``page``.
"""

from upholster.studio.routes import make_studio, run_studio

__all__ = ["make_studio", "run_studio"]
