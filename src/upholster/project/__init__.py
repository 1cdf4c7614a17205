"""Projects: model, samples and settings; `project`, its `file`, and a `preview` while it is changed.

`joint_progress` reports the progress of a preview as one number.
"""

from upholster.project.file import project_data, project_of, read_project, save_project
from upholster.project.preview import Look, Preview
from upholster.project.project import KINDS, Project

__all__ = [
    "KINDS",
    "Look",
    "Preview",
    "Project",
    "project_data",
    "project_of",
    "read_project",
    "save_project",
]
