"""What `docs/make_gallery.py` draws the gallery's pictures with."""
