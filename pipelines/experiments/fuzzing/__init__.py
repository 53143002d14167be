"""Logs, profiles and configurations that a fuzzer makes up, guided by which code they reach."""
