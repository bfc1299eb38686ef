"""The functions that record, apart from the driver that calls them: files whose text becomes part of modules, as there."""
