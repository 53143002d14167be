"""The computer: files, paths, caches, child processes, limits of reading, faults nobody foresaw."""
