"""What each command does, from its options to its answer; `api` is `import shiplog`."""
