"""What ``python docs/make_site.py`` makes of the program: pages that no file holds.

``commands`` is the command line, ``reference`` is Python's public names.
"""
