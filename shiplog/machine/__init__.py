"""The computer: files, paths, caches, limits of reading, faults nobody foresaw."""
