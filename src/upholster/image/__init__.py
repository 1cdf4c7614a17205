"""Images: reading and writing files, colour, resizing."""
