"""Bytes of an MCAP file: records, chunks, a walk through them, and what is damaged."""
