"""Words of the field: channels, units, frames of reference, numbers in sentences."""
