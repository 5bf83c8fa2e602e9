"""An exported program, and the files that it is written to.

Modules: ``exported`` (the program with its check, and which files it makes), ``export_document`` (the document beside
it), ``written_files`` (all files or none).
"""
