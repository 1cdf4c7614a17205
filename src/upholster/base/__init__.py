"""Basics that import nothing but each other: errors, types, lengths, limits, files, formats, options, texts.

- `errors`: errors in one line; `types`: types of arrays and callbacks; `vectors`: unit vectors
- `files`: files that appear together or not at all; `zip_files`: zip files from untrusted sources
- `formats`: all kinds of files; `limits`: a caller's maximum sizes; `examples`: samples in the program
- `lengths`, `conditions`, `guide_texts`: texts as users write them; `json_text`: JSON from outside
- `display`: how objects show themselves; `options`: all options
"""
