"""Projects: model, samples and settings; `project`, its `file`, and a `preview` while it is changed.

`joint_progress` reports the progress of a preview as one number.
"""
