"""One time line: clocks that were set, that contradict, or count another date."""
