"""Pages of docs/ and stubs for editors that are made from the tables and docstrings of the package."""
