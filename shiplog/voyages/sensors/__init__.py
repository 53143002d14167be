"""Small errors of sensors, fitted from one another: scale, offset, delay, lever arm."""
