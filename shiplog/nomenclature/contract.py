"""The version of all JSON that shiplog writes."""

CONTRACT = 1
