"""A robot's build sheet: everything a workshop needs to know about it, as a PDF to print."""
