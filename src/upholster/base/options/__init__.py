"""All options: name, default, meaning and range of each, defined once for library and command line.

One module for each kind of options: `sample_options`, `model_options`, `synthesis_options`, `write_options`.
`option_fields` has what all fields share, `choices` makes options from names and values, `direction_words`
lists the words for directions. Nothing heavy is imported here: ``upholster --help`` is generated from these
fields.
"""
