"""Files from a result or from a stream.

- `outputs`: outputs by name, and a writer for each kind; `export`: the bytes of models and maps
- `output_writer`: painting and writing, for all commands; `atlas_pages`: an atlas page by page
- `glb_picture`: pictures of an existing GLB
- `refinement`, `levels`: files from a stream, and a stream at several levels of quality
- `web_folder`: a folder for a web server; its scripts are in ``web``
- `reports`: the commands' reports
"""
